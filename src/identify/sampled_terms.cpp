#include "identify/sampled_terms.h"

#include <algorithm>
#include <cmath>

namespace sinerig::identify {

using Complex = std::complex<double>;

namespace {

// A delay this close to a whole number of ticks is one: reading it as just above would add a tick.
constexpr double tick_tolerance = 1e-9;

}  // namespace

TickDelay::TickDelay(double delay_s, double period_s)
    : whole_ticks(std::ceil(delay_s / period_s - tick_tolerance)),
      fraction(std::max(whole_ticks - delay_s / period_s, 0.0)) {}

Complex sampled_power(int q, double fraction, double period, Complex z_inverse) {
  const Complex one_less = 1.0 - z_inverse;
  const Complex sum_0 = 1.0 / one_less;
  if (q == 0) return sum_0;
  const Complex sum_1 = z_inverse / (one_less * one_less);
  if (q == 1) return period * (sum_1 + fraction * sum_0);
  const Complex sum_2 = z_inverse * (1.0 + z_inverse) / (one_less * one_less * one_less);
  if (q == 2)
    return period * period / 2.0 * (sum_2 + 2.0 * fraction * sum_1 + fraction * fraction * sum_0);
  const Complex sum_3 = z_inverse * (1.0 + 4.0 * z_inverse + z_inverse * z_inverse) /
                        (one_less * one_less * one_less * one_less);
  return period * period * period / 6.0 *
         (sum_3 + 3.0 * fraction * sum_2 + 3.0 * fraction * fraction * sum_1 +
          fraction * fraction * fraction * sum_0);
}

SampledExponential sampled_exponential(Complex pole, double fraction, double period,
                                       Complex z_inverse) {
  const Complex step = pole * period;
  Complex value;
  Complex later;  // Σ_{n≥0} n exp(p·t) z^−n over the sum without n
  if (step.real() <= 0.0) {
    const Complex ratio = std::exp(step) * z_inverse;
    value = std::exp(step * fraction) / (1.0 - ratio);
    later = ratio / (1.0 - ratio);
  } else {
    const Complex ratio = std::exp(-step) / z_inverse;
    value = -std::exp(-step * (1.0 - fraction)) / z_inverse / (1.0 - ratio);
    later = -1.0 / (1.0 - ratio);
  }
  return {value, period * (fraction + later) * value};
}

}  // namespace sinerig::identify
