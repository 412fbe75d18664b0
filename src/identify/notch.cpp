#include "identify/notch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <sstream>
#include <stdexcept>

namespace sinerig::identify {

namespace {

using Complex = std::complex<double>;

constexpr double pi = std::numbers::pi;
constexpr double turn = 2.0 * pi;
constexpr double z95 = 1.959964;
constexpr double widest = 2.0;  // pole damping; beyond, the "notch" is two lags far apart
constexpr double least_damping = 1e-6;

double decibel(double ratio) {
  return 20.0 * std::log10(ratio);
}

// Peak of |M·N| over peak of |M|, M = 1/(1 − x² + 2jζx) with x = f/mode_hz.
double attenuation_db(const Notch& notch, double mode_hz, double damping) {
  const double zeta = std::max(damping, least_damping);
  double alone = 0.0;
  double with_notch = 0.0;
  constexpr int half_steps = 24;
  for (int i = -half_steps; i <= half_steps; ++i) {
    const double offset = 8.0 * zeta * std::pow(static_cast<double>(i) / half_steps, 3);
    const double x = 1.0 + offset;
    if (x <= 0.0 || (notch.rate_hz > 0.0 && x * mode_hz >= 0.5 * notch.rate_hz)) continue;
    const double M = 1.0 / std::abs(Complex{1.0 - x * x, 2.0 * zeta * x});
    alone = std::max(alone, M);
    with_notch = std::max(with_notch, M * std::abs(notch.at(turn * mode_hz * x)));
  }
  return decibel(alone / with_notch);
}

[[noreturn]] void refuse(double frequency_hz, const std::string& what) {
  std::ostringstream message;
  message.precision(6);
  message << "notch at " << frequency_hz << " Hz: " << what;
  throw std::invalid_argument(message.str());
}

void check(const UncertainMode& mode, const NotchRequest& request) {
  if (!(request.attenuation_db > 0.0) || !std::isfinite(request.attenuation_db))
    refuse(mode.frequency_hz, "the attenuation must be above 0 dB");
  if (!(request.crossover_hz > 0.0) || request.crossover_hz >= mode.low_hz)
    refuse(mode.frequency_hz,
           "the crossover must lie between 0 and the resonance; a notch for a "
           "resonance below it costs no phase there but gains it");
  if (request.rate_hz > 0.0 && mode.high_hz >= 0.5 * request.rate_hz)
    refuse(mode.frequency_hz, "the resonance reaches half the rate; raise the rate");
}

// The narrowest notch of this ratio of dampings that keeps the attenuation.
Notch narrowest(const UncertainMode& mode, const NotchRequest& request, double ratio) {
  const auto of_width = [&](double pole_damping) {
    return Notch{mode.frequency_hz, ratio * pole_damping, pole_damping, request.rate_hz};
  };
  double low = 1e-7;
  double high = 2.0 * widest;
  for (int i = 0; i < 48; ++i) {
    const double middle = std::sqrt(low * high);
    const bool enough = worst_attenuation_db(of_width(middle), mode) >= request.attenuation_db;
    (enough ? high : low) = middle;
  }
  return of_width(high);
}

// As far as a notch that is still one goes; the damping of the resonance limits that, and the width
// of the interval it may lie in.
[[noreturn]] void refuse_too_wide(const UncertainMode& mode, const NotchRequest& request) {
  double most_db = 0.0;
  for (double ratio = 0.99; ratio > 1e-4; ratio *= 0.9) {
    const Notch notch{mode.frequency_hz, ratio * widest, widest, request.rate_hz};
    most_db = std::max(most_db, worst_attenuation_db(notch, mode));
  }
  std::ostringstream what;
  what.precision(3);
  what << request.attenuation_db << " dB wants a notch with poles damped by more than " << widest
       << ", two lags far apart: a resonance damped by up to " << mode.damping_high << ", between "
       << mode.low_hz << " and " << mode.high_hz << " Hz, allows "
       << std::floor(10.0 * most_db) / 10.0 << " dB at most; ask for less, or measure it better";
  refuse(mode.frequency_hz, what.str());
}

}  // namespace

UncertainMode uncertain_mode(const std::vector<Mode>& of_each_fit) {
  if (of_each_fit.empty()) throw std::invalid_argument("notch: no mode to build it for");
  UncertainMode hull{0.0, INFINITY, 0.0, 1.0, 0.0};
  for (const Mode& mode : of_each_fit) {
    const Estimate& f = mode.frequency_hz;
    const Estimate& zeta = mode.damping;
    if (!(zeta.value > 0.0 && zeta.value < 1.0))
      refuse(f.value, "the damping of the mode is not between 0 and 1; it is no resonance");
    const double half = z95 * f.standard_error;
    const double damping_half = z95 * zeta.standard_error;
    hull.low_hz = std::min(hull.low_hz, f.value - half);
    hull.high_hz = std::max(hull.high_hz, f.value + half);
    hull.damping_low = std::min(hull.damping_low, zeta.value - damping_half);
    hull.damping_high = std::max(hull.damping_high, zeta.value + damping_half);
  }
  hull.damping_low = std::max(hull.damping_low, least_damping);
  if (!(hull.low_hz > 0.0)) refuse(hull.high_hz, "the interval of the mode reaches 0 Hz");
  hull.frequency_hz = std::sqrt(hull.low_hz * hull.high_hz);
  return hull;
}

Complex Notch::at(double omega_rad_s) const {
  const double half_period = rate_hz > 0.0 ? 0.5 / rate_hz : 0.0;
  const double centre = turn * frequency_hz;
  const double x = half_period > 0.0
                       ? std::tan(omega_rad_s * half_period) / std::tan(centre * half_period)
                       : omega_rad_s / centre;
  return Complex{1.0 - x * x, 2.0 * zero_damping * x} /
         Complex{1.0 - x * x, 2.0 * pole_damping * x};
}

double Notch::depth_db() const {
  return decibel(zero_damping / pole_damping);
}

double Notch::width_hz() const {
  if (!(rate_hz > 0.0)) return 2.0 * pole_damping * frequency_hz;
  return rate_hz / pi * std::atan(pole_damping * std::sin(turn * frequency_hz / rate_hz));
}

double Notch::phase_deg(double frequency) const {
  return std::arg(at(turn * frequency)) * 180.0 / pi;
}

ZerosPolesGain Notch::zpk() const {
  const double omega = turn * frequency_hz;
  const auto pair = [omega](double damping) {
    const Complex root = std::sqrt(Complex{damping * damping - 1.0, 0.0});
    return std::vector<Complex>{omega * (-damping + root), omega * (-damping - root)};
  };
  return {pair(zero_damping), pair(pole_damping), 1.0, 0.0};
}

Biquad biquad_of(const Notch& notch) {
  if (!(notch.rate_hz > 0.0)) refuse(notch.frequency_hz, "coefficients need a rate; give one");
  if (notch.frequency_hz >= 0.5 * notch.rate_hz)
    refuse(notch.frequency_hz, "the centre is not below half the rate; raise the rate");
  // s/ω0 = (1/t)·(1 − z⁻¹)/(1 + z⁻¹), t = tan(ω0T/2); times t²(1 + z⁻¹)².
  const double t = std::tan(pi * notch.frequency_hz / notch.rate_hz);
  const double z = 2.0 * notch.zero_damping * t;
  const double p = 2.0 * notch.pole_damping * t;
  const double a0 = 1.0 + p + t * t;
  return {(1.0 + z + t * t) / a0, 2.0 * (t * t - 1.0) / a0, (1.0 - z + t * t) / a0,
          2.0 * (t * t - 1.0) / a0, (1.0 - p + t * t) / a0};
}

double worst_attenuation_db(const Notch& notch, const UncertainMode& mode) {
  double worst = INFINITY;
  for (const double frequency : {mode.low_hz, mode.frequency_hz, mode.high_hz})
    for (const double damping : {mode.damping_low, mode.damping_high})
      worst = std::min(worst, attenuation_db(notch, frequency, damping));
  return worst;
}

NotchDesign design_notch(const UncertainMode& mode, const NotchRequest& request) {
  check(mode, request);
  const double gain = std::pow(10.0, -request.attenuation_db / 20.0);
  const auto cost = [&](const Notch& notch) {
    return -notch.phase_deg(request.crossover_hz);
  };
  // The closed form has the ratio gain²; the width of the mode moves the optimum towards gain.
  const double golden = 0.5 * (std::sqrt(5.0) - 1.0);
  double a = std::log(gain * gain) - 1.0;
  double b = std::log(gain) - 1e-3;
  Notch best = narrowest(mode, request, std::exp(a));
  for (int i = 0; i < 24; ++i) {
    const double left = b - golden * (b - a);
    const double right = a + golden * (b - a);
    const Notch at_left = narrowest(mode, request, std::exp(left));
    const Notch at_right = narrowest(mode, request, std::exp(right));
    const bool left_better = cost(at_left) < cost(at_right);
    (left_better ? b : a) = left_better ? right : left;
    const Notch& better = left_better ? at_left : at_right;
    if (cost(better) < cost(best)) best = better;
  }
  if (best.pole_damping > widest) refuse_too_wide(mode, request);
  return {best, worst_attenuation_db(best, mode), cost(best)};
}

}  // namespace sinerig::identify
