#include "sweep/tone.h"

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace sinerig {

namespace {

struct Fraction {
  std::uint64_t numerator;
  std::uint64_t denominator;
};

// Smallest denominator in [low, high], 0 < low <= high: peel off the common integer part and go on
// with the reciprocals (the continued fraction common to both ends).
Fraction simplest_between(double low, double high) {
  const double whole = std::floor(low);
  const auto integer = static_cast<std::uint64_t>(whole);
  if (whole == low) return {integer, 1};
  if (whole + 1.0 <= high) return {integer + 1, 1};
  const Fraction rest = simplest_between(1.0 / (high - whole), 1.0 / (low - whole));
  return {integer * rest.numerator + rest.denominator, rest.numerator};
}

}  // namespace

CoherentFrequency snap(double frequency_hz, double rate_hz, double relative_tolerance) {
  if (!(frequency_hz > 0.0) || !(frequency_hz < rate_hz / 2.0)) {
    throw std::invalid_argument("snap: the frequency must be above 0 and below half the rate");
  }
  if (!(relative_tolerance > 0.0) || relative_tolerance > 0.1) {
    throw std::invalid_argument("snap: the tolerance must be in (0, 0.1]");
  }
  const double ratio = frequency_hz / rate_hz;
  const double low = ratio * (1.0 - relative_tolerance);
  const double high = std::min(ratio * (1.0 + relative_tolerance), std::nextafter(0.5, 0.0));
  const Fraction simplest = simplest_between(low, high);
  return {simplest.numerator, simplest.denominator};
}

namespace {

// Processors convert signed numbers in one instruction, unsigned ones in ten.
double to_double(std::uint64_t below_2_63) noexcept {
  return static_cast<double>(static_cast<std::int64_t>(below_2_63));
}

// cos and sin of 0 <= x <= π/4 by their Taylor series, the terms in pairs (Estrin) so that few wait
// for each other; the first left out are below 2e-18 and 1e-19.
Phasor below_45_deg(double x) noexcept {
  const double z = x * x;
  const double z2 = z * z;
  const double z4 = z2 * z2;
  constexpr double c4 = 1.0 / 24.0, c6 = c4 / 30.0, c8 = c6 / 56.0, c10 = c8 / 90.0,
                   c12 = c10 / 132.0, c14 = c12 / 182.0, c16 = c14 / 240.0;
  constexpr double s3 = 1.0 / 6.0, s5 = s3 / 20.0, s7 = s5 / 42.0, s9 = s7 / 72.0, s11 = s9 / 110.0,
                   s13 = s11 / 156.0, s15 = s13 / 210.0, s17 = s15 / 272.0;
  const double cosine_rest =
      (c4 - c6 * z) + (c8 - c10 * z) * z2 + ((c12 - c14 * z) + c16 * z2) * z4;
  const double sine_rest =
      (-s3 + s5 * z) + (-s7 + s9 * z) * z2 + ((-s11 + s13 * z) + (-s15 + s17 * z) * z2) * z4;
  const double half = 0.5 * z;
  const double rounded = 1.0 - half;
  return {.cosine = rounded + (((1.0 - rounded) - half) + z2 * cosine_rest),
          .sine = x + x * z * sine_rest};
}

}  // namespace

double eighth_turn_rad(std::uint64_t samples) noexcept {
  return std::numbers::pi / 4.0 / to_double(samples);
}

Phasor phasor(std::uint64_t index, std::uint64_t samples) noexcept {
  return phasor(index, samples, eighth_turn_rad(samples));
}

Phasor phasor(std::uint64_t index, std::uint64_t samples, double eighth_turn_rad) noexcept {
  // Eighths of a turn: 8·index = octant·samples + rest. By comparing, which beats a division, and
  // without a branch: which octant comes next is nothing that a processor could guess.
  std::uint64_t rest = 8 * index;
  std::uint64_t octant = 0;
  for (const std::uint64_t step : {4U, 2U, 1U}) {
    const std::uint64_t in = rest >= step * samples ? 1 : 0;
    rest -= in * step * samples;
    octant += in * step;
  }
  const std::uint64_t folded = (octant & 1) != 0 ? samples - rest : rest;
  const double angle = to_double(folded) * eighth_turn_rad;
  const Phasor in_octant = below_45_deg(angle);
  const double near_axis = in_octant.cosine;
  // At 45° the two differ by a rounding; one value keeps the symmetry.
  const double off_axis = folded == samples ? near_axis : in_octant.sine;
  const bool upright = ((octant + 1) & 2) != 0;  // octants 1, 2, 5, 6 are about the axis of sines
  const double cosine = upright ? off_axis : near_axis;
  const double sine = upright ? near_axis : off_axis;
  return {((octant + 2) & 4) != 0 ? -cosine : cosine, (octant & 4) != 0 ? -sine : sine};
}

}  // namespace sinerig
