#include "report/drift.h"

#include <algorithm>
#include <cmath>
#include <ostream>

#include <nlohmann/json.hpp>

#include "record/text.h"

namespace sinerig::report {

namespace {

using Json = nlohmann::ordered_json;
using record::text;

constexpr double normal_975 = 1.959963984540054;

Json number(double value) {
  return std::isfinite(value) ? Json(value) : Json();
}

bool gone(const DriftFigure& figure) {
  return std::isnan(figure.first) != std::isnan(figure.other);
}

}  // namespace

bool Drift::changed() const {
  return std::any_of(figures.begin(), figures.end(), [](const auto& each) { return each.changed; });
}

DriftFigure drift_figure(const std::string& name, const std::string& unit, double first,
                         double first95, double other, double other95) {
  DriftFigure figure{.name = name, .unit = unit, .first = first, .other = other};
  figure.change = other - first;
  figure.change95 = std::hypot(first95, other95);
  const double deviations = std::abs(figure.change) / figure.change95 * normal_975;
  figure.probability = figure.change == 0.0 ? 1.0 : std::erfc(deviations / std::sqrt(2.0));
  return figure;
}

void judge(Drift& drift, double false_alarm, double tolerance) {
  const double threshold =
      false_alarm / static_cast<double>(std::max<std::size_t>(1, drift.figures.size()));
  for (DriftFigure& figure : drift.figures) {
    const bool beyond = std::abs(figure.change) > tolerance * std::abs(figure.first);
    figure.changed = gone(figure) || (beyond && figure.probability < threshold);
  }
}

void print_drift(std::ostream& stream, const std::string& first, const Drift& drift) {
  stream << drift.name << " against " << first << ", model\n"
         << text("%-28s %12s %12s %12s %10s %10s\n", "", first.substr(0, 12).c_str(),
                 drift.name.substr(0, 12).c_str(), "change", "±", "p");
  for (const DriftFigure& figure : drift.figures) {
    const std::string name = figure.name + (figure.unit.empty() ? "" : ", " + figure.unit);
    stream << text("%-28s %12.6g %12.6g %+12.4g %10.2g %10.2g%s\n", name.c_str(), figure.first,
                   figure.other, figure.change, figure.change95, figure.probability,
                   gone(figure)     ? "  in one only"
                   : figure.changed ? "  changed"
                                    : "");
  }
  stream << (drift.changed() ? "changed: the model by more than its intervals explain"
                             : "same: no change of the model that its intervals do not explain")
         << "\n\n";
}

Json drift_json(const Drift& drift) {
  Json figures = Json::array();
  for (const DriftFigure& figure : drift.figures) {
    figures.push_back({{"name", figure.name},
                       {"unit", figure.unit},
                       {"first", number(figure.first)},
                       {"other", number(figure.other)},
                       {"change", number(figure.change)},
                       {"change95", number(figure.change95)},
                       {"p", number(figure.probability)},
                       {"changed", figure.changed}});
  }
  return {{"name", drift.name}, {"changed", drift.changed()}, {"figures", figures}};
}

}  // namespace sinerig::report
