#include "report/comparison.h"

#include <algorithm>
#include <cmath>
#include <ostream>

#include <nlohmann/json.hpp>

#include "record/text.h"

namespace sinerig::report {

using record::Difference;
using record::PointDifference;
using record::text;

std::string verdict(const Difference& difference) {
  const std::size_t changed = difference.changed_points();
  const char* measure =
      difference.scatter_known() ? "their scatter explains" : "is tolerated (no scatter is known)";
  std::string words;
  if (!difference.compared())
    words = text("%snothing compared, no frequency at which both are good",
                 difference.changed() ? "changed: " : "");
  else if (changed > 0)
    words = text("changed: %zu of %zu points by more than %s", changed, difference.points.size(),
                 measure);
  else
    words = text(difference.scatter_known()
                     ? "%s %zu points that their scatter does not explain"
                     : "%s %zu points that is not tolerated (no scatter is known)",
                 difference.changed() ? "changed: points are lost, though no change in the other"
                                      : "same: no change in",
                 difference.points.size());
  if (difference.lost > 0) words += text("; %zu were good and are not any more", difference.lost);
  const std::size_t others = difference.unusable - difference.lost;
  if (others > 0) words += text("; %zu left out, not good", others);
  if (difference.unmatched > 0) words += text("; %zu in one file only", difference.unmatched);
  return words;
}

std::string brief_verdict(const Difference& difference) {
  const std::size_t changed = difference.changed_points();
  if (changed > 0) return text("%zu of %zu points changed", changed, difference.points.size());
  if (difference.changed())
    return text("changed: %zu of %zu points lost", difference.lost,
                difference.points.size() + difference.lost);
  return difference.compared() ? text("same in %zu points", difference.points.size())
                               : "nothing to compare";
}

const char* verdict_word(const Difference& difference) {
  return difference.changed() ? "changed" : difference.compared() ? "same" : "nothing compared";
}

std::vector<std::string> files_without_points(const std::vector<std::string>& files,
                                              const std::vector<Difference>& differences) {
  std::vector<std::string> without;
  for (std::size_t i = 1; i < files.size(); ++i) {
    const bool compared = std::any_of(
        differences.begin(), differences.end(),
        [&](const Difference& each) { return each.file == files[i] && each.compared(); });
    if (!compared) without.push_back(files[i]);
  }
  return without;
}

void print_comparison(std::ostream& stream, const std::string& first,
                      const std::vector<Difference>& differences) {
  for (const Difference& difference : differences) {
    stream << difference.name << " against " << first << '\n';
    stream << text("%14s %12s %10s %12s %10s %10s\n", "Hz", "gain dB", "± dB", "phase °", "± °",
                   "p");
    for (const PointDifference& point : difference.points) {
      stream << text("%14.6f %+12.4f %10.2g %+12.3f %10.2g %10.2g%s\n", point.frequency_hz,
                     point.gain_db, point.gain95_db, point.phase_deg, point.phase95_deg,
                     point.probability, point.changed ? "  changed" : "");
    }
    if (!difference.points.empty()) {
      const auto largest = std::max_element(
          difference.points.begin(), difference.points.end(),
          [](const auto& a, const auto& b) { return std::abs(a.gain_db) < std::abs(b.gain_db); });
      stream << text("largest change of the gain: %+.4f dB at %.6g Hz\n", largest->gain_db,
                     largest->frequency_hz);
    }
    stream << verdict(difference) << "\n\n";
  }
}

nlohmann::ordered_json comparison_json(const std::string& first,
                                       const std::vector<Difference>& differences,
                                       const std::vector<Drift>& drifts) {
  using Json = nlohmann::ordered_json;
  const auto number = [](double value) {
    return std::isfinite(value) ? Json(value) : Json();
  };
  bool changed = false;
  Json list = Json::array();
  for (const Difference& difference : differences) {
    changed = changed || difference.changed();
    Json points = Json::array();
    for (const PointDifference& point : difference.points) {
      points.push_back({{"freq_hz", point.frequency_hz},
                        {"gain_db", number(point.gain_db)},
                        {"gain95_db", number(point.gain95_db)},
                        {"phase_deg", number(point.phase_deg)},
                        {"phase95_deg", number(point.phase95_deg)},
                        {"p", number(point.probability)},
                        {"changed", point.changed}});
    }
    list.push_back({{"name", difference.name},
                    {"compared", difference.points.size()},
                    {"changed", difference.changed()},
                    {"lost", difference.lost},
                    {"unmatched", difference.unmatched},
                    {"unusable", difference.unusable},
                    {"points", points}});
  }
  Json drift = Json::array();
  for (const Drift& each : drifts) {
    changed = changed || each.changed();
    drift.push_back(drift_json(each));
  }
  return {{"reference", first}, {"changed", changed}, {"differences", list}, {"drift", drift}};
}

}  // namespace sinerig::report
