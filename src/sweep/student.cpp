#include "sweep/student.h"

#include <algorithm>
#include <cmath>

namespace sinerig {

namespace {

constexpr double normal_975 = 1.959963984540054;
constexpr double exact_up_to_four[] = {12.706204736, 4.302652730, 3.182446305, 2.776445105};

// Expansion in 1/dof (Abramowitz and Stegun 26.7.5); good to 1e-3 from four degrees on.
double expansion(double dof) noexcept {
  constexpr double z = normal_975;
  constexpr double z3 = z * z * z;
  constexpr double z5 = z3 * z * z;
  constexpr double z7 = z5 * z * z;
  constexpr double g1 = (z3 + z) / 4.0;
  constexpr double g2 = (5.0 * z5 + 16.0 * z3 + 3.0 * z) / 96.0;
  constexpr double g3 = (3.0 * z7 + 19.0 * z5 + 17.0 * z3 - 15.0 * z) / 384.0;
  return z + (g1 + (g2 + g3 / dof) / dof) / dof;
}

}  // namespace

double student_t_975(double dof) noexcept {
  if (!(dof > 1.0)) return exact_up_to_four[0];
  if (dof >= 4.0) return expansion(dof);
  // Between the exact values, interpolated in 1/dof on a logarithmic quantile.
  const auto below = static_cast<int>(dof);
  const double low = static_cast<double>(below);
  const double position = (1.0 / low - 1.0 / dof) / (1.0 / low - 1.0 / (low + 1.0));
  const double log_low = std::log(exact_up_to_four[below - 1]);
  const double log_high = std::log(exact_up_to_four[std::min(below, 3)]);
  return std::exp(log_low + position * (log_high - log_low));
}

}  // namespace sinerig
