// How the figures of a model and its loop have moved from one measurement to another.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace sinerig::report {

// A figure in two measurements, each with the half width of its 95 % interval.
struct DriftFigure {
  std::string name;
  std::string unit;
  double first = 0.0;  // NaN: that measurement has no such figure
  double other = 0.0;
  double change = 0.0;
  double change95 = 0.0;     // half width of the joint 95 % interval
  double probability = 0.0;  // of a change at least as large from scatter alone
  bool changed = false;
};

struct Drift {
  std::string name;  // of the later measurement
  std::vector<DriftFigure> figures;

  bool changed() const;
};

// change, change95 and probability from both values and their half widths: independent and normal.
DriftFigure drift_figure(const std::string& name, const std::string& unit, double first,
                         double first95, double other, double other95);

// Marks what has changed: p below false_alarm divided by the number of figures, and more than
// `tolerance` of the first value; a figure that one of the two lacks has changed.
void judge(Drift& drift, double false_alarm, double tolerance);

void print_drift(std::ostream& stream, const std::string& first, const Drift& drift);
nlohmann::ordered_json drift_json(const Drift& drift);

}  // namespace sinerig::report
