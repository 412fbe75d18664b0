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

Phasor phasor(std::uint64_t index, std::uint64_t samples) noexcept {
  // Eighths of a turn: 8·index = octant·samples + rest, by comparing, which beats a division.
  std::uint64_t rest = 8 * index;
  std::uint64_t octant = 0;
  for (const std::uint64_t step : {4U, 2U, 1U}) {
    if (rest >= step * samples) {
      rest -= step * samples;
      octant += step;
    }
  }
  const bool odd = (octant & 1) != 0;
  const std::uint64_t folded = odd ? samples - rest : rest;
  const double angle =
      std::numbers::pi / 4.0 * (static_cast<double>(folded) / static_cast<double>(samples));
  const double cosine = std::cos(angle);
  // At 45° the two differ by a rounding; one value keeps the symmetry.
  const double sine = folded == samples ? cosine : std::sin(angle);
  switch (octant) {
    case 0: return {cosine, sine};
    case 1: return {sine, cosine};
    case 2: return {-sine, cosine};
    case 3: return {-cosine, sine};
    case 4: return {-cosine, -sine};
    case 5: return {-sine, -cosine};
    case 6: return {sine, -cosine};
    default: return {cosine, -sine};
  }
}

}  // namespace sinerig
