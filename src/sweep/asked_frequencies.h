// The frequencies of a sweep as they are asked for, before they are snapped to the grid of the
// loop.
#pragma once

#include <cstdint>
#include <vector>

#include "sweep/sweep_settings.h"

namespace sinerig {

// The range of a sweep cut into `count` sub-bands of equal width, logarithmic or linear as its
// spacing, each with all its points.
std::vector<SubBand> equal_sub_bands(const SweepSettings& sweep, std::uint32_t count);

struct AskedFrequency {
  double hz = 0.0;
  std::uint32_t sub_band = 0;
};

// What the settings ask for, in running order, before it is snapped to the grid of the loop.
std::vector<AskedFrequency> asked_of(const SweepSettings& sweep);

// The frequencies asked for, in Hz and in running order, those of all sub-bands included.
std::vector<double> asked_frequencies(const SweepSettings& sweep);

}  // namespace sinerig
