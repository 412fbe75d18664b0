#include "report/model_curve.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "identify/hold.h"
#include "identify/loop_curve.h"
#include "identify/root_covariance.h"
#include "identify/transfer_function.h"

namespace sinerig::report {

namespace {

constexpr double turn = 2.0 * std::numbers::pi;
constexpr int curve_steps = 400;
constexpr int peak_steps = 12;  // quarters of the half-power half-width, to either side

// By its roots where the file has them all: they keep the accuracy that coefficients lose.
identify::ZerosPolesGain roots_of(const record::StoredFit& fit) {
  const bool complete = fit.gain && fit.poles.size() + 1 == fit.den.size();
  if (!complete)
    return identify::to_zeros_poles_gain({.num = fit.num, .den = fit.den, .delay_s = fit.delay_s});
  return {.zeros = fit.zeros, .poles = fit.poles, .gain = *fit.gain, .delay_s = fit.delay_s};
}

}  // namespace

std::vector<std::complex<double>> model_response(const record::StoredFit& fit,
                                                 const std::vector<double>& frequency_hz) {
  const identify::ZerosPolesGain model = roots_of(fit);
  const double period_s = fit.hold_period_s;
  std::vector<std::complex<double>> response;
  for (const double each : frequency_hz) {
    const double omega = turn * each;
    std::complex<double> value = model.at(omega);
    if (period_s > 0.0) value *= identify::hold_factor(omega, period_s);
    response.push_back(value);
  }
  const auto count = static_cast<Eigen::Index>(frequency_hz.size());
  const Eigen::ArrayXd omega = turn * Eigen::Map<const Eigen::ArrayXd>(frequency_hz.data(), count);
  if (period_s > 0.0 && count > 0 && omega.maxCoeff() * period_s < std::numbers::pi) {
    try {
      const Eigen::ArrayXcd held = identify::held_response(model, period_s, omega);
      response.assign(held.begin(), held.end());
    } catch (const std::invalid_argument&) {
      // A model that the exact hold does not cover keeps the factor.
    }
  }
  std::transform(response.begin(), response.end(), frequency_hz.begin(), response.begin(),
                 [&](const std::complex<double>& value, double hz) {
                   return value * std::polar(1.0, -turn * hz * fit.path_delay_s);
                 });
  return response;
}

ModelBand model_band(const record::StoredFit& fit, const std::vector<double>& frequency_hz) {
  constexpr double z95 = 1.959964;
  const identify::ZerosPolesGain model = roots_of(fit);
  const auto size = static_cast<Eigen::Index>(fit.root_covariance.size());
  if (size == 0 || size != identify::coordinates_of(model)) return {};
  identify::RootCovariance covariance{turn * fit.reference_hz, Eigen::MatrixXd(size, size)};
  for (Eigen::Index i = 0; i < size; ++i) {
    const std::vector<double>& row = fit.root_covariance[static_cast<std::size_t>(i)];
    if (row.size() != fit.root_covariance.size()) return {};
    covariance.covariance.row(i) = Eigen::Map<const Eigen::RowVectorXd>(row.data(), size);
  }
  ModelBand band;
  for (const double hz : frequency_hz) {
    const identify::LogScatter scatter =
        identify::log_scatter(identify::response_with_covariance(model, covariance, turn * hz));
    band.gain.push_back(z95 * std::sqrt(scatter.gain));
    band.phase_rad.push_back(z95 * std::sqrt(scatter.phase));
  }
  return band;
}

const record::StoredFit* latest_choe(const record::StoredRun& run,
                                     const record::StoredResponse& response) {
  const auto found = std::find_if(run.fits.rbegin(), run.fits.rend(), [&](const auto& fit) {
    return fit.choe && fit.input == response.input && fit.output == response.output;
  });
  return found == run.fits.rend() ? nullptr : &*found;
}

const record::StoredFit* latest_fit(const record::StoredRun& run,
                                    const record::StoredResponse& response) {
  const auto found = std::find_if(run.fits.rbegin(), run.fits.rend(), [&](const auto& fit) {
    return fit.input == response.input && fit.output == response.output;
  });
  return found == run.fits.rend() ? nullptr : &*found;
}

std::vector<double> curve_grid(const record::StoredFit& fit, double from_hz, double to_hz) {
  if (!(to_hz > from_hz)) return {from_hz};
  std::vector<double> grid;
  for (int i = 0; i <= curve_steps; ++i)
    grid.push_back(from_hz * std::pow(to_hz / from_hz, static_cast<double>(i) / curve_steps));
  grid.back() = to_hz;
  const identify::ZerosPolesGain model = roots_of(fit);
  for (const auto* roots : {&model.poles, &model.zeros}) {
    for (const std::complex<double>& root : *roots) {
      if (root.imag() <= 0.0) continue;
      for (int k = -peak_steps; k <= peak_steps; ++k) {
        const double each = (root.imag() + 0.25 * k * std::abs(root.real())) / turn;
        if (each > from_hz && each < to_hz) grid.push_back(each);
      }
    }
  }
  std::sort(grid.begin(), grid.end());
  return grid;
}

}  // namespace sinerig::report
