#include "record/compare.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "record/confidence.h"
#include "sweep/student.h"

namespace sinerig::record {

namespace {

constexpr double frequency_tolerance = 1e-6;
// A text format writes twelve digits or so: the same run read back is not another one.
constexpr double rounding = 1e-10;

bool usable(const StoredPoint& point) {
  const bool trusted = point.status == "good" || point.status == "imported";
  return trusted && std::isfinite(std::abs(point.response)) && std::abs(point.response) > 0.0;
}

// Two circular scatters together, with the degrees of freedom of Welch and Satterthwaite.
struct JointScatter {
  double variance = nan_value;  // of each of re and im
  double degrees = nan_value;
};

JointScatter joint_scatter(const StoredPoint& a, const StoredPoint& b) {
  const double va = circular_variance(a);
  const double vb = circular_variance(b);
  // Where only one file carries its scatter the other's is taken to be as large.
  if (!std::isfinite(va) && !std::isfinite(vb)) return {};
  if (!std::isfinite(va) || !std::isfinite(vb)) {
    const bool first = std::isfinite(va);
    return {.variance = 2.0 * (first ? va : vb), .degrees = first ? a.dof : b.dof};
  }
  const double sum = va + vb;
  const double spread = va * va / a.dof + vb * vb / b.dof;
  return {.variance = sum,
          .degrees = spread > 0.0 ? sum * sum / spread : std::numeric_limits<double>::infinity()};
}

// The tail of F(2, ν) for |d|² = distance2; that of an exponential without limit of ν.
double tail(double distance2, const JointScatter& scatter) {
  if (std::isnan(scatter.variance)) return nan_value;
  if (distance2 == 0.0) return 1.0;
  const double relative = distance2 / scatter.variance;
  if (std::isinf(scatter.degrees)) return std::exp(-0.5 * relative);
  return std::pow(1.0 + relative / scatter.degrees, -0.5 * scatter.degrees);
}

PointDifference difference(const StoredPoint& a, const StoredPoint& b) {
  PointDifference result{.frequency_hz = a.frequency_hz};
  const std::complex<double> ratio = b.response / a.response;
  result.gain_db = 20.0 * std::log10(std::abs(ratio));
  result.phase_deg = std::arg(ratio) * degrees_per_radian;
  result.relative = std::abs(ratio - 1.0);
  const JointScatter scatter = joint_scatter(a, b);
  const double size = std::min(std::abs(a.response), std::abs(b.response));
  const double half = student_t_975(scatter.degrees) * std::sqrt(scatter.variance) / size;
  result.gain95_db = half * db_per_relative;
  result.phase95_deg = std::isnan(half) ? nan_value : std::min(180.0, half * degrees_per_radian);
  result.probability = tail(std::norm(b.response - a.response), scatter);
  // Of two figures one alone is as large by chance less often than both together: on the safe side.
  const double gain = size * std::log(std::abs(ratio));
  const double phase = size * std::arg(ratio);
  result.gain_probability = tail(gain * gain, scatter);
  result.phase_probability = tail(phase * phase, scatter);
  return result;
}

bool same_frequency(double a, double b) {
  return std::abs(a - b) <= frequency_tolerance * std::max(a, b);
}

}  // namespace

bool Difference::scatter_known() const {
  return std::any_of(points.begin(), points.end(),
                     [](const auto& each) { return !std::isnan(each.probability); });
}

std::size_t Difference::changed_points() const {
  return static_cast<std::size_t>(
      std::count_if(points.begin(), points.end(), [](const auto& each) { return each.changed; }));
}

Difference compare_responses(const StoredResponse& first, const StoredResponse& other,
                             const CompareSettings& settings) {
  Difference result;
  std::size_t i = 0;
  std::size_t k = 0;
  while (i < first.points.size() && k < other.points.size()) {
    const StoredPoint& a = first.points[i];
    const StoredPoint& b = other.points[k];
    if (!same_frequency(a.frequency_hz, b.frequency_hz)) {
      ++result.unmatched;
      ++(a.frequency_hz < b.frequency_hz ? i : k);
      continue;
    }
    if (usable(a) && usable(b)) {
      result.points.push_back(difference(a, b));
    } else {
      ++result.unusable;
      if (usable(a)) ++result.lost;
    }
    ++i;
    ++k;
  }
  result.unmatched += first.points.size() - i + other.points.size() - k;

  const double threshold =
      settings.false_alarm / static_cast<double>(std::max<std::size_t>(1, result.points.size()));
  for (PointDifference& point : result.points) {
    const bool gain = std::abs(point.gain_db) > settings.tolerance_db;
    const bool phase = std::abs(point.phase_deg) > settings.tolerance_deg;
    const double probability = gain && phase ? point.probability
                               : gain        ? point.gain_probability
                                             : point.phase_probability;
    const bool explained = !std::isnan(probability) && probability >= threshold;
    point.changed = (gain || phase) && !explained && point.relative > rounding;
  }
  return result;
}

}  // namespace sinerig::record
