#include "sweep/point_interval.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sweep/student.h"

namespace sinerig {

namespace {

constexpr double db_per_relative = 20.0 / std::numbers::ln10;
constexpr double degrees_per_radian = 180.0 / std::numbers::pi;

}  // namespace

Interval interval_of(std::complex<double> response, const PooledVariance& variance, double left,
                     double scale) noexcept {
  const double square = std::norm(response);
  const Covariance2& c = variance.covariance;
  const double re = response.real();
  const double im = response.imag();
  // Variances along and across H, relative to it.
  const double along =
      (re * re * c.re_re + 2.0 * re * im * c.re_im + im * im * c.im_im) / square / square;
  const double across =
      (im * im * c.re_re - 2.0 * re * im * c.re_im + re * re * c.im_im) / square / square;
  const double t = student_t_975(variance.dof) * std::sqrt(scale);
  return {.gain_db = db_per_relative * std::sqrt(t * t * along + left * left),
          .phase_deg = degrees_per_radian * std::sqrt(t * t * across + left * left)};
}

double smaller_target(double gain_db, double phase_deg) noexcept {
  return std::min(gain_db > 0.0 ? gain_db / db_per_relative : 1.0,
                  phase_deg > 0.0 ? phase_deg / degrees_per_radian : 1.0);
}

}  // namespace sinerig
