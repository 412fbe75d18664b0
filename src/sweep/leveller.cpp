#include "sweep/leveller.h"

#include <algorithm>
#include <cmath>

namespace sinerig {

namespace {

// Steepest slope believed when looking ahead, in decades of gain per decade: two integrators.
// Resonances are steeper, but a point or two of them foretells nothing.
constexpr double steepest = 2.0;

// A point that drowned is tried again at this many times the amplitude.
constexpr double louder = 4.0;

// A point that clipped says only that the amplitude was too large.
constexpr double quieter = 0.3;

}  // namespace

double Leveller::bounded(double scale, double planned_amplitude) const noexcept {
  const double least = std::min(1.0, level_.least_amplitude / planned_amplitude);
  return std::clamp(scale, least, 1.0);
}

double Leveller::scale(double frequency_hz, double planned_amplitude) const noexcept {
  if (!level_.wanted()) return 1.0;
  // Nothing is known of the rig yet: begin as quietly as allowed.
  if (known_ == 0) return bounded(0.0, planned_amplitude);
  double slope = 0.0;
  if (known_ > 1 && last_.log_frequency != before_.log_frequency) {
    slope = (last_.log_gain - before_.log_gain) / (last_.log_frequency - before_.log_frequency);
    slope = std::clamp(slope, -steepest, steepest);
  }
  const double ahead = last_.log_gain + slope * (std::log(frequency_hz) - last_.log_frequency);
  return bounded(level_.response / std::exp(ahead) / planned_amplitude, planned_amplitude);
}

void Leveller::learn(const Point& point) noexcept {
  const double gain = std::abs(point.response);
  if (!(gain > 0.0) || !std::isfinite(gain)) return;
  before_ = last_;
  last_ = {.log_frequency = std::log(point.frequency_hz), .log_gain = std::log(gain)};
  known_ = std::min(known_ + 1, 2);
}

std::optional<double> Leveller::retry(const Point& point, double scale,
                                      double planned_amplitude) noexcept {
  if (!level_.wanted()) return std::nullopt;
  const bool drowned = point.status == PointStatus::low_signal;
  const bool too_loud = point.output_amplitude > level_.most_response;
  double next = scale;
  if (point.status == PointStatus::clipped) {
    next = scale * quieter;
  } else if (too_loud) {
    next = scale * level_.response / point.output_amplitude;
  } else if (drowned || point.output_amplitude < level_.response / louder) {
    const double missing = level_.response / std::max(point.output_amplitude, 1e-300);
    next = scale * (drowned ? std::max(louder, missing) : missing);
  }
  next = bounded(next, planned_amplitude);
  const bool worth_it = std::abs(std::log(next / scale)) > 0.1;
  if (worth_it && tries_ < level_.retries) {
    ++tries_;
    return next;
  }
  accept(point);
  return std::nullopt;
}

void Leveller::accept(const Point& point) noexcept {
  tries_ = 0;
  learn(point);
}

}  // namespace sinerig
