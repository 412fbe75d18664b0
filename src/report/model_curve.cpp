#include "report/model_curve.h"

#include <cmath>
#include <numbers>

#include "identify/transfer_function.h"

namespace sinerig::report {

std::complex<double> model_at(const record::StoredFit& fit, double frequency_hz) {
  const double omega = 2.0 * std::numbers::pi * frequency_hz;
  const identify::TransferFunction model{.num = fit.num, .den = fit.den, .delay_s = fit.delay_s};
  const double half_angle = 0.5 * omega * fit.hold_period_s;
  const double sinc = half_angle > 0.0 ? std::sin(half_angle) / half_angle : 1.0;
  return model.at(omega) * std::polar(sinc, -half_angle);
}

std::vector<double> log_grid(double from_hz, double to_hz, std::size_t count) {
  if (!(to_hz > from_hz)) return {from_hz};
  std::vector<double> grid;
  for (std::size_t i = 0; i < count; ++i) {
    const double part = static_cast<double>(i) / static_cast<double>(count - 1);
    grid.push_back(from_hz * std::pow(to_hz / from_hz, part));
  }
  grid.back() = to_hz;
  return grid;
}

}  // namespace sinerig::report
