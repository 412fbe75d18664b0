// A discrete second-order section, in floating and in fixed point.
#pragma once

#include <array>
#include <complex>
#include <cstdint>

namespace sinerig::identify {

// y[n] = b0 x[n] + b1 x[n−1] + b2 x[n−2] − a1 y[n−1] − a2 y[n−2].
struct Biquad {
  double b0 = 1.0;
  double b1 = 0.0;
  double b2 = 0.0;
  double a1 = 0.0;
  double a2 = 0.0;

  // At z = exp(j·angle), angle = ωT in rad.
  std::complex<double> at(double angle_rad) const;
  // Both poles inside the unit circle (Jury): |a2| < 1 and |a1| < 1 + a2.
  bool stable() const;
  std::array<double, 5> coefficients() const { return {b0, b1, b2, a1, a2}; }
};

// Coefficients as integers of `bits` bits, sign included, of which `fraction_bits` follow the
// binary point: value = integer / 2^fraction_bits.
struct FixedBiquad {
  int bits = 32;
  int fraction_bits = 30;
  std::array<std::int64_t, 5> integers{};  // b0 b1 b2 a1 a2

  Biquad value() const;
};

// Rounded to nearest. Throws std::invalid_argument when bits is not 8 … 48, fraction_bits not
// 1 … bits − 1, a coefficient does not fit (a notch needs two integer bits: Q2.30 of 32), or the
// rounding takes the stability away (then the format is too short for so low a frequency).
FixedBiquad quantised(const Biquad& biquad, int bits, int fraction_bits);

}  // namespace sinerig::identify
