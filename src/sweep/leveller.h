// Keeps the response near a wanted level: the amplitude of the next dwell from the gains of the
// last two, and another try for a point that clipped, overshot or drowned.
#pragma once

#include <cstdint>
#include <optional>

#include "sweep/nonblocking.h"
#include "sweep/plan.h"
#include "sweep/records.h"

namespace sinerig {

class Leveller {
 public:
  explicit Leveller(const Level& level) : level_{level} {}

  // The part of the planned amplitude, its hard maximum, to begin the dwell with; 1 without a
  // level.
  double scale(double frequency_hz, double planned_amplitude) const noexcept SINERIG_NONBLOCKING;

  // After a dwell at `scale`: another scale to try it with, or nothing when the point stands. The
  // first response's first tone is what counts.
  std::optional<double> retry(const Point& point, double scale,
                              double planned_amplitude) noexcept SINERIG_NONBLOCKING;

  // A point of an earlier part of this sweep that stood.
  void recall(const Point& point) noexcept {
    if (level_.wanted()) learn(point);
  }

 private:
  struct Gain {
    double log_frequency = 0.0;
    double log_gain = 0.0;
  };

  double bounded(double scale, double planned_amplitude) const noexcept;
  void learn(const Point& point) noexcept;

  Level level_;
  Gain last_;
  Gain before_;
  int known_ = 0;
  std::uint32_t tries_ = 0;
};

}  // namespace sinerig
