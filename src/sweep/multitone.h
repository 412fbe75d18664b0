// Several tones in one dwell: which frequencies go together, the block that is whole cycles of all
// of them, and the phases with which their sum stays low.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sweep/tone.h"

namespace sinerig {

// Cycles of every tone in one common block.
struct CommonBlock {
  std::uint64_t samples = 0;  // 0: there is none
  std::vector<std::uint64_t> cycles;
};

// Frequencies in groups of up to `tones`, far apart within a group: their sum then needs no longer
// block than the lowest alone, and shares its peak among bands that hardly disturb each other.
// Each group rises; the groups rise by their lowest.
std::vector<std::vector<double>> interleaved(std::vector<double> frequencies_hz, std::size_t tones);

// The shortest block in which the lowest frequency is met within `tolerance` and all others within
// `tones_tolerance` (relative), no two in the same bin, all below half the rate; with `odd_bins`
// every tone is an odd number of cycles, so that what a nonlinear plant makes of two of them lies
// in between. `frequencies_hz` rise. No samples where 256 cycles of the lowest are not enough.
CommonBlock common_block(std::span<const double> frequencies_hz, double rate_hz, double tolerance,
                         double tones_tolerance, bool odd_bins);

// Start phases that keep the peak of Σ A_i sin(ω_i t + φ_i) low: the best of Newman's (φ = π i²/K)
// and of a fixed number of random ones (fixed seed), moved in time so that the sum begins near
// zero.
std::vector<double> low_crest_phases(const CommonBlock& block, std::span<const double> amplitudes);

// The peak of that sum, and of its first and second difference quotients, over a block.
struct TonePeaks {
  double value = 0.0;
  double per_s = 0.0;
  double per_s2 = 0.0;
};
TonePeaks peaks_of(const CommonBlock& block, std::span<const double> amplitudes,
                   std::span<const double> phases_rad, double rate_hz);

}  // namespace sinerig
