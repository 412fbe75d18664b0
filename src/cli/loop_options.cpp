#include "cli/loop_options.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <numbers>
#include <stdexcept>

#include <spdlog/spdlog.h>

#include "identify/hold.h"
#include "identify/loop_analysis.h"
#include "identify/polynomial.h"

namespace sinerig::cli {

namespace {

using Complex = std::complex<double>;

constexpr double turn = 2.0 * std::numbers::pi;
constexpr double beyond_measured = 3.0;  // the model is searched this far beyond the frequencies

std::string listed(const std::vector<double>& values) {
  std::string text;
  for (const double value : values) {
    char number[32];
    std::snprintf(number, sizeof number, "%.6g", value);
    if (!text.empty()) text += ',';
    text += number;
  }
  return text;
}

// C at the frequencies of the loop: by Tustin where it runs at a rate.
Complex controller_at(const identify::ZerosPolesGain& controller, double rate_hz, double omega) {
  if (rate_hz <= 0.0) return controller.at(omega);
  return controller.at(Complex{0.0, 2.0 * rate_hz * std::tan(0.5 * omega / rate_hz)});
}

identify::Curve measured_controller(const LoopOptions& options) {
  return identify::Curve::of_points(
      read_fit_input(options.controller_file, "", options.trust_units).response);
}

}  // namespace

bool has_controller(const LoopOptions& options) {
  return !options.controller_num.empty() || !options.controller_den.empty() ||
         !options.pid.empty() || !options.controller_file.empty();
}

identify::ZerosPolesGain controller_of(const LoopOptions& options) {
  const bool rational = !options.controller_num.empty() || !options.controller_den.empty();
  const int named = (rational ? 1 : 0) + (options.pid.empty() ? 0 : 1) +
                    (options.controller_file.empty() ? 0 : 1);
  if (named > 1)
    throw std::invalid_argument(
        "the controller is given more than once; give --controller-num and --controller-den, or "
        "--pid, or --controller-file");
  if (rational) {
    if (options.controller_num.empty() || options.controller_den.empty())
      throw std::invalid_argument("--controller-num and --controller-den belong together");
    return identify::to_zeros_poles_gain({options.controller_num, options.controller_den, 0.0});
  }
  if (!options.pid.empty()) {
    if (options.pid.size() < 3 || options.pid.size() > 4)
      throw std::invalid_argument("--pid: wanted KP,KI,KD or KP,KI,KD,FILTER_HZ");
    const double filter_hz = options.pid.size() == 4 ? options.pid[3] : 0.0;
    if (options.pid.size() == 4 && !(filter_hz > 0.0))
      throw std::invalid_argument("--pid: the filter of the derivative must be above 0 Hz");
    return identify::pid(options.pid[0], options.pid[1], options.pid[2], turn * filter_hz);
  }
  return {};
}

std::string controller_text(const LoopOptions& options) {
  if (!options.controller_file.empty()) return "controller " + options.controller_file;
  if (!options.pid.empty()) return "PID " + listed(options.pid);
  if (!options.controller_num.empty())
    return "controller " + listed(options.controller_num) + " over " +
           listed(options.controller_den);
  return "no controller";
}

double loop_rate_hz(const LoopOptions& options, const FitInput& measured) {
  const double rate_hz = options.rate_hz.value_or(has_controller(options) ? measured.rate_hz : 0.0);
  if (!(rate_hz >= 0.0) || !std::isfinite(rate_hz))
    throw std::invalid_argument("--rate: wanted a rate in Hz, or 0 for a continuous controller");
  if (rate_hz > 0.0 && options.pid.size() == 3 && options.pid[2] != 0.0)
    throw std::invalid_argument(
        "--pid: a controller that runs at a rate has to filter its derivative; give FILTER_HZ as "
        "the fourth number, or --rate 0 for a continuous one");
  return rate_hz;
}

void warn_of_unknown_hold(const LoopOptions& options, const FitInput& measured) {
  if (measured.rate_hz > 0.0 || options.hold_hz || !(loop_rate_hz(options, measured) > 0.0)) return;
  spdlog::warn(
      "{} does not say the rate of the loop that it was measured in; if a hold drove the plant it "
      "is counted twice here: --hold HZ takes it out, --hold none says that there was none",
      measured.label);
}

identify::LoopModel model_loop(const LoopOptions& options, const PlantModel& plant) {
  identify::ZerosPolesGain delayed = plant.zpk;
  delayed.delay_s += options.delay_s;
  return {delayed, controller_of(options), loop_rate_hz(options, plant.measured)};
}

identify::Curve measured_loop(const LoopOptions& options, const FitInput& measured) {
  const double rate_hz = loop_rate_hz(options, measured);
  const identify::ZerosPolesGain controller = controller_of(options);
  identify::Response points;
  for (identify::ResponsePoint point : measured.response) {
    const double omega = point.omega_rad_s;
    if (rate_hz > 0.0 && omega >= std::numbers::pi * rate_hz) continue;
    Complex factor =
        controller_at(controller, rate_hz, omega) * std::polar(1.0, -omega * options.delay_s);
    if (measured.hold_hz > 0.0) factor /= identify::hold_factor(omega, 1.0 / measured.hold_hz);
    if (rate_hz > 0.0) factor *= identify::hold_factor(omega, 1.0 / rate_hz);
    const double c = factor.real();
    const double s = factor.imag();
    const double rr = point.variance_re;
    const double ri = point.covariance;
    const double ii = point.variance_im;
    points.push_back({omega, factor * point.response, c * c * rr - 2.0 * c * s * ri + s * s * ii,
                      c * s * (rr - ii) + (c * c - s * s) * ri,
                      s * s * rr + 2.0 * c * s * ri + c * c * ii});
  }
  identify::Curve loop = identify::Curve::of_points(points);
  return options.controller_file.empty() ? loop : loop.times(measured_controller(options));
}

identify::Curve searched_curve(const identify::LoopModel& loop, const PlantModel& plant) {
  const identify::Response& points = plant.measured.response;
  const double first = points.front().omega_rad_s / beyond_measured;
  const double limit = loop.highest_rad_s();
  for (double last = points.back().omega_rad_s * beyond_measured;; last *= beyond_measured) {
    identify::Curve curve = loop.curve(first, last, plant.scatter());
    const auto crossings = identify::analyse_loop(curve).phase_crossings;
    const bool crosses =
        std::any_of(crossings.begin(), crossings.end(),
                    [](const identify::GainMargin& each) { return each.frequency_hz.value > 0.0; });
    if (crosses || last >= limit) return curve;
  }
}

identify::Curve model_curve(const LoopOptions& options, const PlantModel& plant) {
  const identify::LoopModel loop = model_loop(options, plant);
  if (options.controller_file.empty()) return searched_curve(loop, plant);
  const identify::Response& points = plant.measured.response;
  return loop
      .curve(points.front().omega_rad_s / beyond_measured,
             points.back().omega_rad_s * beyond_measured, plant.scatter())
      .times(measured_controller(options));
}

}  // namespace sinerig::cli
