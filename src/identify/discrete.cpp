#include "identify/discrete.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "identify/polynomial.h"
#include "identify/state_space.h"

namespace sinerig::identify {

namespace {

using Complex = std::complex<double>;

constexpr double tick_tolerance = 1e-9;

void check(const ZerosPolesGain& model, double period_s) {
  if (!(period_s > 0.0) || !std::isfinite(period_s))
    throw std::invalid_argument("discrete: the period must be above 0 s");
  if (model.zeros.size() > model.poles.size())
    throw std::invalid_argument("discrete: more zeros than poles; the model must be proper");
  if (!(model.delay_s >= 0.0))
    throw std::invalid_argument("discrete: the delay must not be below 0 s");
}

void add_delay(double delay_s, DiscreteModel& model) {
  const double ticks = delay_s / model.period_s;
  const double nearest = std::round(ticks);
  if (std::abs(ticks - nearest) < tick_tolerance) {
    model.delay_ticks = static_cast<int>(nearest);
    return;
  }
  model.delay_ticks = std::max(0, static_cast<int>(std::floor(ticks - 0.5)));
  const double d = ticks - model.delay_ticks;
  const double a = (1.0 - d) / (1.0 + d);
  if (std::abs(a) < 1e-12) {
    ++model.delay_ticks;
    return;
  }
  model.zeros.emplace_back(-1.0 / a);
  model.poles.emplace_back(-a);
  model.gain *= a;
}

std::vector<double> scaled(std::vector<double> coefficients, double factor) {
  for (double& coefficient : coefficients) coefficient *= factor;
  return coefficients;
}

}  // namespace

Complex DiscreteModel::at(double omega_rad_s) const {
  const double angle = omega_rad_s * period_s;
  const ZerosPolesGain rational{zeros, poles, gain, 0.0};
  return rational.at(std::polar(1.0, angle)) * std::polar(1.0, -angle * delay_ticks);
}

std::vector<double> DiscreteModel::num() const {
  return scaled(polynomial_from_roots(zeros), gain);
}

std::vector<double> DiscreteModel::den() const {
  return polynomial_from_roots(poles);
}

DiscreteModel tustin(const ZerosPolesGain& model, double period_s, double prewarp_rad_s) {
  check(model, period_s);
  if (!(prewarp_rad_s >= 0.0 && prewarp_rad_s * period_s < std::numbers::pi))
    throw std::invalid_argument("tustin: the prewarping frequency must lie in 0 … half the rate");
  const double k = prewarp_rad_s > 0.0 ? prewarp_rad_s / std::tan(0.5 * prewarp_rad_s * period_s)
                                       : 2.0 / period_s;
  DiscreteModel out{{}, {}, model.gain, period_s, 0};
  Complex gain = 1.0;
  // s − root = (k − root)·(z − (k + root)/(k − root))/(z + 1).
  for (std::size_t i = 0; i < model.poles.size(); ++i) {
    const Complex pole = model.poles[i];
    out.poles.push_back((k + pole) / (k - pole));
    gain /= k - pole;
    if (i < model.zeros.size()) {
      const Complex zero = model.zeros[i];
      out.zeros.push_back((k + zero) / (k - zero));
      gain *= k - zero;
    } else {
      out.zeros.emplace_back(-1.0);
    }
  }
  out.gain *= gain.real();
  add_delay(model.delay_s, out);
  return out;
}

DiscreteModel hold_equivalent(const ZerosPolesGain& model, double period_s) {
  check(model, period_s);
  const SampledStateSpace system = zero_order_hold(to_state_space(model), period_s);
  DiscreteModel out{{}, {}, 0.0, period_s, system.delay_ticks};
  for (const Complex pole : model.poles) out.poles.push_back(std::exp(pole * period_s));
  while (out.poles.size() < static_cast<std::size_t>(system.A.rows())) out.poles.emplace_back(0.0);
  const std::vector<double> den = out.den();
  std::vector<double> impulse{system.D};
  Eigen::VectorXd state = system.B;
  while (impulse.size() < den.size()) {
    impulse.push_back(system.C.dot(state));
    state = system.A * state;
  }
  std::vector<double> num(den.size(), 0.0);
  for (std::size_t i = 0; i < den.size(); ++i)
    for (std::size_t j = 0; j <= i; ++j) num[i] += den[j] * impulse[i - j];
  // What cancellation leaves of a vanishing leading coefficient is rounding.
  const double size = std::abs(*std::max_element(
      num.begin(), num.end(), [](double a, double b) { return std::abs(a) < std::abs(b); }));
  for (double& coefficient : num) {
    if (std::abs(coefficient) > 1e-14 * size) break;
    coefficient = 0.0;
  }
  if (size == 0.0) return out;
  out.zeros = roots_of(num);
  out.gain = leading_coefficient(num);
  return out;
}

DiscreteModel matched(const ZerosPolesGain& model, double period_s) {
  check(model, period_s);
  DiscreteModel out{{}, {}, 1.0, period_s, 0};
  bool at_origin = false;
  const auto image = [&](Complex root) {
    at_origin = at_origin || root == 0.0;
    return std::exp(root * period_s);
  };
  for (const Complex zero : model.zeros) out.zeros.push_back(image(zero));
  for (const Complex pole : model.poles) out.poles.push_back(image(pole));
  while (out.zeros.size() + 1 < out.poles.size()) out.zeros.emplace_back(-1.0);
  const double omega = at_origin ? 2.0 * std::numbers::pi * 1e-3 / period_s : 0.0;
  ZerosPolesGain rational = model;
  rational.delay_s = 0.0;
  const Complex wanted = rational.at(omega);
  const Complex ratio = wanted / out.at(omega);
  out.gain = omega == 0.0 ? ratio.real() : std::copysign(std::abs(ratio), ratio.real());
  add_delay(model.delay_s, out);
  return out;
}

}  // namespace sinerig::identify
