#include "record/confidence.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "sweep/student.h"

namespace sinerig::record {

namespace {

HalfWidth95 from_covariance(const StoredPoint& point) {
  const double re = point.response.real();
  const double im = point.response.imag();
  const double square = std::norm(point.response);
  const Covariance2& c = point.covariance;
  const double along = re * re * c.re_re + 2.0 * re * im * c.re_im + im * im * c.im_im;
  const double across = im * im * c.re_re - 2.0 * re * im * c.re_im + re * re * c.im_im;
  const double scale = student_t_975(point.dof) / square;
  return {.gain = scale * std::sqrt(std::max(0.0, along)),
          .phase_rad = scale * std::sqrt(std::max(0.0, across))};
}

}  // namespace

HalfWidth95 half_width95(const StoredPoint& point) {
  const bool known = point.dof > 0.0 && std::abs(point.response) > 0.0;
  if (!known) return {nan_value, nan_value};
  const bool stored = std::isfinite(point.gain_interval_db + point.phase_interval_deg);
  HalfWidth95 half = stored
                         ? HalfWidth95{.gain = point.gain_interval_db / db_per_relative,
                                       .phase_rad = point.phase_interval_deg / degrees_per_radian}
                         : from_covariance(point);
  half.phase_rad = std::min(half.phase_rad, std::numbers::pi);
  return half;
}

double circular_variance(const StoredPoint& point) {
  const HalfWidth95 half = half_width95(point);
  const double t = student_t_975(point.dof);
  return 0.5 * (half.gain * half.gain + half.phase_rad * half.phase_rad) *
         std::norm(point.response) / (t * t);
}

double coherence(const StoredPoint& point, double rate_hz) {
  if (!(point.dof > 0.0) || !(rate_hz > 0.0)) return nan_value;
  const double cycles = point.samples * point.frequency_hz / rate_hz;
  const double signal = std::norm(point.response);
  const double noise = 2.0 * cycles * point.covariance.mean_variance();
  return signal / (signal + noise);
}

}  // namespace sinerig::record
