#include "report/comparison.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <ostream>

namespace sinerig::report {

namespace {

using record::Difference;
using record::PointDifference;

[[gnu::format(printf, 1, 2)]] std::string text(const char* format, ...) {
  char buffer[256];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(buffer, sizeof buffer, format, arguments);
  va_end(arguments);
  return buffer;
}

std::string verdict(const Difference& difference) {
  std::string words =
      difference.changed()
          ? text("changed: %zu of %zu points by more than their scatter explains",
                 difference.changed_points(), difference.points.size())
          : text("same: no change in %zu points that their scatter does not explain",
                 difference.points.size());
  if (difference.unusable > 0) words += text("; %zu left out, not good", difference.unusable);
  if (difference.unmatched > 0) words += text("; %zu in one file only", difference.unmatched);
  return words;
}

}  // namespace

void print_comparison(std::ostream& stream, const std::string& first,
                      const std::vector<Difference>& differences) {
  for (const Difference& difference : differences) {
    stream << difference.name << " against " << first << '\n';
    stream << text("%14s %12s %10s %12s %10s %10s\n", "Hz", "gain dB", "± dB", "phase °", "± °",
                   "p");
    for (const PointDifference& point : difference.points) {
      stream << text("%14.6f %+12.4f %10.2g %+12.3f %10.2g %10.2g  %s\n", point.frequency_hz,
                     point.gain_db, point.gain95_db, point.phase_deg, point.phase95_deg,
                     point.probability, point.changed ? "changed" : "");
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

}  // namespace sinerig::report
