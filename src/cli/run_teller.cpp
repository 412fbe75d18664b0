#include "cli/run_teller.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <langinfo.h>
#include <locale.h>
#include <unistd.h>

#include <nlohmann/json.hpp>
#include <spdlog/spdlog.h>
#include <sys/ioctl.h>

#include "record/stored_point.h"
#include "report/report_data.h"
#include "report/terminal.h"

namespace sinerig::cli {

namespace {

using Json = nlohmann::ordered_json;
using report::Progress;

// As the environment wants it for the terminal's characters; sinerig itself speaks the C locale.
bool speaks_utf8() {
  const locale_t locale = newlocale(LC_CTYPE_MASK, "", locale_t{});
  if (locale == locale_t{}) return false;
  const bool utf8 = std::strcmp(nl_langinfo_l(CODESET, locale), "UTF-8") == 0;
  freelocale(locale);
  return utf8;
}

// https://no-color.org
bool colour_wanted() {
  const char* refused = std::getenv("NO_COLOR");
  return refused == nullptr || *refused == '\0';
}

Progress::Screen screen() {
  Progress::Screen found{.colour = colour_wanted()};
  winsize size{};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0) return found;
  if (size.ws_col > 0) found.columns = size.ws_col;
  if (size.ws_row > 0) found.rows = size.ws_row;
  return found;
}

Progress::Style style_of(Voice voice) {
  if (voice != Voice::text) return Progress::Style::none;
  const char* term = std::getenv("TERM");
  const bool dumb = term == nullptr || std::strcmp(term, "dumb") == 0;
  const bool drawable = isatty(STDOUT_FILENO) != 0 && !dumb && speaks_utf8();
  return drawable ? Progress::Style::live : Progress::Style::lines;
}

void print_line(const Json& json) {
  std::cout << json.dump(-1, ' ', false, Json::error_handler_t::replace) << std::endl;
}

}  // namespace

RunTeller::RunTeller(Voice voice, bool table, const config::Rig& rig, const SweepPlan& plan)
    : voice_{voice},
      table_{table},
      rig_{rig},
      plan_{plan},
      progress_{std::cout, style_of(voice), plan, screen} {}

void RunTeller::plan(const std::string& live_page) {
  if (voice_ == Voice::json) {
    Json line{{"type", "plan"},
              {"rig", rig_.file->name()},
              {"rate_hz", plan_.rate_hz},
              {"points", report::point_count(plan_)},
              {"dwells", plan_.dwells.size()},
              {"least_s", plan_.min_seconds()},
              {"most_s", plan_.max_seconds()}};
    if (!live_page.empty()) line["live_page"] = live_page;
    return print_line(line);
  }
  spdlog::info("{}, {} of bench time", report::plan_size_text(plan_),
               report::bench_time_text(plan_));
  // Quiet or not: without the token in it nobody could stop the run from the page.
  if (!live_page.empty()) std::cerr << "live page: " << live_page << std::endl;
}

void RunTeller::resume(const std::vector<Point>& points) {
  progress_.resume(points);
}

void RunTeller::point(const Point& point) {
  if (voice_ != Voice::json) return progress_.point(point);
  const auto channel = [&](std::size_t index) {
    return index < first_sensor_channel ? std::string{"applied"}
                                        : rig_.sensors[index - first_sensor_channel].name;
  };
  Json line{{"type", "point"},
            {"dwell", point.dwell},
            {"output", channel(point.output)},
            {"input", channel(point.input)}};
  const Json columns = report::point_columns({record::stored_point(point, plan_.rate_hz)});
  for (const auto& [name, column] : columns.items()) {
    if (name != "extra") line[name == "f" ? "freq_hz" : name] = column.at(0);
  }
  print_line(line);
}

void RunTeller::update(std::uint32_t dwell, std::uint64_t tick) {
  progress_.update(dwell, tick);
}

void RunTeller::close() {
  progress_.close();
}

void RunTeller::end(const RunEnd& end) {
  if (voice_ == Voice::json) {
    end_as_json(end);
  } else {
    end_in_words(end);
  }
}

void RunTeller::end_in_words(const RunEnd& end) {
  if (voice_ == Voice::text && table_ && !end.sweep_file.empty())
    report::print_run(std::cout, record::read_sweep(end.sweep_file));
  std::cout.flush();  // before the messages on standard error
  if (!end.reason.empty()) spdlog::error("{}", end.reason);
  if (end.dropped_samples > 0) {
    spdlog::warn("{} samples were dropped: the disk is too slow for [output] samples",
                 end.dropped_samples);
  }
  if (!end.sweep_file.empty()) spdlog::info("wrote {}", end.sweep_file);
  if (!end.report_file.empty())
    spdlog::info("wrote {}, the report: open it in a browser", end.report_file);
}

void RunTeller::end_as_json(const RunEnd& end) {
  const record::StoredRun run =
      end.sweep_file.empty() ? record::StoredRun{} : record::read_sweep(end.sweep_file);
  std::uint64_t skipped = 0;
  std::int64_t latest_ns = 0;
  for (const record::StoredTiming& timing : run.timings) {
    skipped += timing.skipped;
    latest_ns = std::max(latest_ns, timing.max_lateness_ns);
  }
  std::size_t points = 0;
  std::size_t good = 0;
  for (const record::StoredResponse& response : run.responses) {
    points += response.points.size();
    good += static_cast<std::size_t>(
        std::count_if(response.points.begin(), response.points.end(),
                      [](const auto& point) { return point.status == "good"; }));
  }
  Json line{{"type", "end"},
            {"outcome", end.outcome},
            {"reason", end.reason},
            {"points", points},
            {"good", good},
            {"skipped_ticks", skipped},
            {"max_lateness_us", static_cast<double>(latest_ns) * 1e-3},
            {"dropped_samples", end.dropped_samples},
            {"sweep", end.sweep_file.empty() ? Json{} : Json(end.sweep_file)}};
  line["report"] = end.report_file.empty() ? Json{} : Json(end.report_file);
  print_line(line);
}

}  // namespace sinerig::cli
