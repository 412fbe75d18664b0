#include "sweep/asked_frequencies.h"

#include <cmath>

namespace sinerig {

namespace {

double between(Spacing spacing, double start_hz, double stop_hz, double position) {
  return spacing == Spacing::linear ? start_hz + (stop_hz - start_hz) * position
                                    : start_hz * std::pow(stop_hz / start_hz, position);
}

}  // namespace

std::vector<AskedFrequency> asked_of(const SweepSettings& sweep) {
  std::vector<AskedFrequency> asked;
  if (sweep.spacing == Spacing::list) {
    for (const double hz : sweep.frequencies_hz) asked.push_back({hz, 0});
    return asked;
  }
  std::vector<SubBand> bands = sweep.sub_bands;
  if (bands.empty()) bands = {{sweep.start_hz, sweep.stop_hz, sweep.points}};
  for (std::uint32_t k = 0; k < bands.size(); ++k) {
    const SubBand& band = bands[k];
    for (std::uint32_t i = 0; i < band.points; ++i) {
      const double position = band.points == 1 ? 0.0 : static_cast<double>(i) / (band.points - 1);
      // The ends are what was asked for, not what pow() makes of them.
      const bool last = i > 0 && i + 1 == band.points;
      const double hz =
          last ? band.stop_hz : between(sweep.spacing, band.start_hz, band.stop_hz, position);
      if (i == 0 && !asked.empty() && asked.back().hz == hz) continue;
      asked.push_back({hz, k});
    }
  }
  return asked;
}

std::vector<SubBand> equal_sub_bands(const SweepSettings& sweep, std::uint32_t count) {
  std::vector<SubBand> bands;
  for (std::uint32_t i = 0; i < count; ++i) {
    const double high = static_cast<double>(i + 1) / count;
    bands.push_back({.start_hz = i == 0 ? sweep.start_hz : bands.back().stop_hz,
                     .stop_hz = i + 1 == count
                                    ? sweep.stop_hz
                                    : between(sweep.spacing, sweep.start_hz, sweep.stop_hz, high),
                     .points = sweep.points});
  }
  return bands;
}

std::vector<double> asked_frequencies(const SweepSettings& sweep) {
  std::vector<double> frequencies_hz;
  for (const AskedFrequency& asked : asked_of(sweep)) frequencies_hz.push_back(asked.hz);
  return frequencies_hz;
}

}  // namespace sinerig
