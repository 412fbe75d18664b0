// What is known of the plant's modes before a dwell begins: poles, and how well they are known.
// Carried from dwell to dwell, each making it sharper.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "sweep/normal_equations.h"

namespace sinerig {

// exp(st), s = sigma + j omega; omega 0: a real pole, else it stands for the pair.
struct ModePole {
  double sigma_rad_s = 0.0;
  double omega_rad_s = 0.0;

  bool real() const noexcept { return omega_rad_s == 0.0; }
  // Numbers that describe it, and as many amplitudes in a transient.
  std::size_t size() const noexcept { return real() ? 1 : 2; }
};

struct ModePrior {
  static constexpr std::size_t max_modes = 8;
  static constexpr std::size_t max_parameters = 2 * max_modes;

  std::size_t modes = 0;
  std::array<ModePole, max_modes> poles{};
  // Covariance of (sigma, omega) of the poles in their order, a real pole sigma only; lower
  // triangle by rows.
  std::array<double, triangle(max_parameters)> covariance{};
  // Ticks after a change of the command in which its older past still shows beside the modes: the
  // dead time, rounded up, and one.
  std::uint32_t blind_ticks = 4;

  std::span<const ModePole> known() const noexcept { return {poles.data(), modes}; }
  std::size_t parameters() const noexcept {
    std::size_t sum = 0;
    for (const ModePole& pole : known()) sum += pole.size();
    return sum;
  }
};

}  // namespace sinerig
