#include "identify/fit_setup.h"

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "identify/hold.h"
#include "identify/search.h"

namespace sinerig::identify {

namespace {

using Complex = std::complex<double>;

[[noreturn]] void refuse(const std::string& what) {
  throw std::invalid_argument("fit: " + what);
}

// Measured to order 26 over four decades; twice that is beyond any use of it.
constexpr int highest_order = 52;

void check_numbers(const FitOptions& options) {
  for (const double number : {options.delay_s, options.path_delay_s, options.hold_period_s,
                              options.model_error, options.static_gain.value_or(1.0)})
    if (!std::isfinite(number)) refuse("an option is not finite; give a number");
  if (options.path_delay_s < 0.0 || (options.delay == Delay::known && options.delay_s < 0.0))
    refuse("a delay is below zero; a plant cannot answer before it is driven");
  if (options.hold_period_s < 0.0) refuse("the hold period is below zero; 0 means no hold");
  if (options.model_error < 0.0) refuse("the model error is below zero; 0 means none");
  if (options.static_gain == 0.0) refuse("a static gain of zero; ask for a zero at the origin");
}

void check_orders(const FitOptions& options) {
  const std::string orders = std::to_string(options.zeros) + " zeros, " +
                             std::to_string(options.poles) + " poles, " +
                             std::to_string(options.origin) + " at the origin";
  if (options.zeros < 0 || options.poles < 0 || options.zeros > highest_order ||
      options.poles > highest_order)
    refuse(orders + "; zeros and poles must be between 0 and " + std::to_string(highest_order));
  const int fixed_poles =
      std::max(options.origin, 0) + static_cast<int>(options.given_poles.size());
  if (fixed_poles > options.poles)
    refuse(orders + " and " + std::to_string(options.given_poles.size()) +
           " given poles; the poles must count those at the origin and those given; raise poles");
  if (-options.origin > options.zeros)
    refuse(orders + "; the zeros must count those at the origin; raise zeros");
}

void check_given_poles(const std::vector<Complex>& poles) {
  Complex sum = 0.0;
  for (const Complex pole : poles) {
    if (!std::isfinite(std::abs(pole)) || pole == 0.0)
      refuse("a given pole is at the origin or not finite; count it with origin instead");
    int balance = 0;
    for (const Complex other : poles) balance += (other == pole) - (other == std::conj(pole));
    if (balance != 0) refuse("the given poles must come in conjugate pairs; add the missing one");
    sum += pole;
  }
}

void check_hold(const Response& response, const FitOptions& options) {
  if (options.hold_period_s == 0.0) return;
  const double half_rate_hz = 0.5 / options.hold_period_s;
  const double last_hz = response.back().omega_rad_s / (2.0 * std::numbers::pi);
  if (last_hz >= half_rate_hz)
    refuse("the last point at " + std::to_string(last_hz) +
           " Hz is not below half the rate of the hold, " + std::to_string(half_rate_hz) +
           " Hz; remove it or correct the rate");
  if (options.zeros > options.poles)
    refuse("behind a hold the model must have at least as many poles as zeros; lower zeros");
  if (options.origin > 3) refuse("behind a hold at most three poles at the origin; lower origin");
}

ZerosPolesGain fixed_factors(const FitOptions& options) {
  ZerosPolesGain fixed;
  for (int i = 0; i < options.origin; ++i) fixed.poles.emplace_back(0.0);
  for (int i = 0; i < -options.origin; ++i) fixed.zeros.emplace_back(0.0);
  fixed.poles.insert(fixed.poles.end(), options.given_poles.begin(), options.given_poles.end());
  if (options.delay == Delay::known) fixed.delay_s = options.delay_s;
  return fixed;
}

}  // namespace

FitSetup prepare_fit(const Response& response, const FitOptions& options) {
  check_numbers(options);
  check_orders(options);
  check_given_poles(options.given_poles);
  FitSetup setup;
  Freedom& freedom = setup.freedom;
  freedom.degrees.numerator = options.zeros - std::max(-options.origin, 0);
  freedom.degrees.denominator =
      options.poles - std::max(options.origin, 0) - static_cast<int>(options.given_poles.size());
  freedom.delay = options.delay == Delay::fit;
  freedom.stable_poles = options.stable;
  freedom.stable_zeros = options.minimum_phase;

  const int values = std::max({freedom.parameters() - (options.static_gain ? 1 : 0),
                               freedom.degrees.denominator + 1, freedom.degrees.numerator + 1});
  check_response(response, static_cast<std::size_t>((values + 1) / 2));
  check_hold(response, options);

  setup.fixed = fixed_factors(options);
  setup.fixed_and_path = setup.fixed;
  setup.fixed_and_path.delay_s += options.path_delay_s;
  setup.data = make_fit_data(response, options.model_error);
  for (Eigen::Index i = 0; i < setup.data.points(); ++i) {
    const double omega = setup.data.omega[i];
    setup.data.known[i] = setup.fixed_and_path.at(omega);
    if (options.hold_period_s > 0.0)
      setup.data.known[i] *= hold_factor(omega, options.hold_period_s);
  }
  if (options.static_gain) {
    double ratio = *options.static_gain;
    for (const Complex pole : options.given_poles)
      ratio *= pole.imag() == 0.0 ? -pole.real() : std::abs(pole);
    freedom.static_ratio = ratio;
  }
  if (freedom.delay) freedom.largest_delay_s = largest_plausible_delay(setup.data, freedom.degrees);
  return setup;
}

}  // namespace sinerig::identify
