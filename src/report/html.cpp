#include "report/html.h"

#include <ostream>
#include <sstream>
#include <string_view>

#include <nlohmann/json.hpp>

#include "report/figure.h"
#include "report/page.h"
#include "report/xml.h"
#include "version.h"

namespace sinerig::report {

namespace {

// JSON inside a script element: "</" would end it, "<!--" would comment it out.
std::string embedded(const nlohmann::ordered_json& data) {
  const std::string plain =
      data.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  std::string safe;
  safe.reserve(plain.size());
  for (const char each : plain) {
    if (each == '<') {
      safe += "\\u003c";
    } else {
      safe += each;
    }
  }
  return safe;
}

struct Filling {
  std::string_view mark;
  std::string_view text;
};

// One pass over the template, so that a mark inside a filling stays what it is.
void write_filled(std::ostream& stream, std::string_view page,
                  const std::vector<Filling>& fillings) {
  while (!page.empty()) {
    std::size_t at = page.size();
    const Filling* next = nullptr;
    for (const Filling& filling : fillings) {
      const std::size_t found = page.find(filling.mark);
      if (found < at) {
        at = found;
        next = &filling;
      }
    }
    stream << page.substr(0, at);
    if (next == nullptr) return;
    stream << next->text;
    page.remove_prefix(at + next->mark.size());
  }
}

void write_page(std::ostream& stream, const nlohmann::ordered_json& data,
                const std::string& picture) {
  const std::string title = xml_text(data.at("title").get<std::string>()) + " – sinerig";
  const std::string json = embedded(data);
  write_filled(stream, page_template,
               {{"@VERSION@", version},
                {"@TITLE@", title},
                {"@STYLE@", page_style},
                {"@FIGURE@", picture},
                {"@DATA@", json},
                {"@SCRIPT@", page_script}});
}

}  // namespace

void write_html(std::ostream& stream, const LabelledRun& run, const nlohmann::ordered_json& loop) {
  std::ostringstream picture;
  if (!run.run.responses.empty()) write_bode_svg(picture, run, run.run.responses.front());
  nlohmann::ordered_json page = page_of_run(run);
  page["loop"] = loop;
  write_page(stream, page, picture.str());
}

void write_html(std::ostream& stream, const std::vector<LabelledRun>& runs,
                const std::vector<record::Difference>& differences,
                const std::vector<Drift>& drifts) {
  nlohmann::ordered_json page = page_of_comparison(runs, differences);
  page["drift"] = nlohmann::ordered_json::array();
  bool moved = false;
  for (const Drift& drift : drifts) {
    moved = moved || drift.changed();
    page["drift"].push_back(drift_json(drift));
  }
  if (moved) page["outcome"] = page["outcome_text"] = "changed";
  write_page(stream, page, "");
}

}  // namespace sinerig::report
