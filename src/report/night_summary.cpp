#include "report/night_summary.h"

#include <algorithm>
#include <cmath>
#include <ostream>

#include <nlohmann/json.hpp>

#include "record/text.h"
#include "report/comparison.h"
#include "report/terminal.h"

namespace sinerig::report {

namespace {

using Json = nlohmann::ordered_json;
using record::Difference;
using record::PointDifference;
using record::text;

// The point that speaks most against no change.
const PointDifference* least_likely(const Difference& difference) {
  const auto found = std::min_element(
      difference.points.begin(), difference.points.end(), [](const auto& a, const auto& b) {
        if (std::isnan(a.probability) != std::isnan(b.probability)) {
          return std::isnan(b.probability);
        }
        return a.probability < b.probability;
      });
  return found == difference.points.end() ? nullptr : &*found;
}

std::string line_of(const Difference& difference) {
  std::string words = difference.name + ": " + brief_verdict(difference);
  if (const PointDifference* most = least_likely(difference)) {
    words +=
        text("; most at %.5g Hz, %+.4f dB ± %.2g, %+.3f° ± %.2g, p %.2g", most->frequency_hz,
             most->gain_db, most->gain95_db, most->phase_deg, most->phase95_deg, most->probability);
  }
  if (difference.lost > 0) words += text("; %zu not good any more", difference.lost);
  if (difference.unmatched > 0) words += text("; %zu in one of them only", difference.unmatched);
  return words;
}

}  // namespace

bool NightRow::changed() const {
  return std::any_of(differences.begin(), differences.end(),
                     [](const Difference& each) { return each.changed(); });
}

void print_night(std::ostream& stream, const std::string& job, const std::vector<NightRow>& rows) {
  stream << "night    " << job << "\n\n";
  stream << text("%-24s %-20s %11s %12s %6s  %s\n", "sweep", "began", "bench time", "good points",
                 "parts", "outcome");
  for (const NightRow& row : rows) {
    const std::string name = row.name + "-" + std::to_string(row.repeat);
    stream << text("%-24s %-20s %11s %12s %6zu  ", name.c_str(), row.started_utc.c_str(),
                   duration_text(row.bench_s).c_str(),
                   text("%zu of %zu", row.good, row.points).c_str(), row.parts)
           << row.outcome << (row.detail.empty() ? "" : ": " + row.detail) << '\n';
  }
  stream << "\nbetween repeats, against the first\n";
  bool any = false;
  for (const NightRow& row : rows) {
    for (const Difference& difference : row.differences) {
      stream << "  " << line_of(difference) << '\n';
      any = true;
    }
  }
  if (!any) stream << "  nothing to compare: no sweep has two repeats with points\n";
}

Json night_json(const std::string& job, const std::vector<NightRow>& rows) {
  Json sweeps = Json::array();
  bool changed = false;
  for (const NightRow& row : rows) {
    changed = changed || row.changed();
    Json compared = comparison_json(row.name + "-1", row.differences, {});
    sweeps.push_back({{"name", row.name},
                      {"repeat", row.repeat},
                      {"file", row.file},
                      {"outcome", row.outcome},
                      {"detail", row.detail},
                      {"started_utc", row.started_utc},
                      {"bench_s", row.bench_s},
                      {"points", row.points},
                      {"good", row.good},
                      {"parts", row.parts},
                      {"changed", row.changed()},
                      {"differences", compared.at("differences")}});
  }
  return {{"format", "sinerig-night"}, {"job", job}, {"changed", changed}, {"sweeps", sweeps}};
}

}  // namespace sinerig::report
