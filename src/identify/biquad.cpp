#include "identify/biquad.h"

#include <cmath>
#include <stdexcept>
#include <string>

namespace sinerig::identify {

std::complex<double> Biquad::at(double angle_rad) const {
  const std::complex<double> delay = std::polar(1.0, -angle_rad);
  return (b0 + delay * (b1 + delay * b2)) / (1.0 + delay * (a1 + delay * a2));
}

bool Biquad::stable() const {
  return std::abs(a2) < 1.0 && std::abs(a1) < 1.0 + a2;
}

Biquad FixedBiquad::value() const {
  std::array<double, 5> c{};
  for (std::size_t i = 0; i < c.size(); ++i)
    c[i] = std::ldexp(static_cast<double>(integers[i]), -fraction_bits);
  return {c[0], c[1], c[2], c[3], c[4]};
}

FixedBiquad quantised(const Biquad& biquad, int bits, int fraction_bits) {
  std::string format = "Q";
  format.append(std::to_string(bits - fraction_bits)).append(".");
  format.append(std::to_string(fraction_bits));
  if (bits < 8 || bits > 48 || fraction_bits < 1 || fraction_bits >= bits)
    throw std::invalid_argument(
        "biquad: " + format + " is no format; wanted 8 to 48 bits, at least one before the point");
  FixedBiquad fixed{bits, fraction_bits, {}};
  const double most = std::ldexp(1.0, bits - 1);
  const std::array<double, 5> c = biquad.coefficients();
  for (std::size_t i = 0; i < c.size(); ++i) {
    const double scaled = std::nearbyint(std::ldexp(c[i], fraction_bits));
    if (!(scaled >= -most && scaled < most))
      throw std::invalid_argument("biquad: the coefficient " + std::to_string(c[i]) +
                                  " does not fit " + format + "; use more bits before the point");
    fixed.integers[i] = static_cast<std::int64_t>(scaled);
  }
  if (biquad.stable() && !fixed.value().stable())
    throw std::invalid_argument("biquad: rounded to " + format +
                                " it is unstable; use more bits or a lower rate");
  return fixed;
}

}  // namespace sinerig::identify
