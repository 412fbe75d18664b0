#include "cli/joint_input.h"

#include <cmath>
#include <cstdlib>
#include <stdexcept>
#include <string>

#include <spdlog/spdlog.h>

#include "identify/scatter.h"

namespace sinerig::cli {

namespace {

double number_of(const std::string& text, const std::string& option, const std::string& wanted) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != '\0' || !std::isfinite(value))
    throw std::invalid_argument(option + " is \"" + text + "\"; wanted " + wanted);
  return value;
}

}  // namespace

JointInput read_joint_input(const FitCommandOptions& options) {
  JointInput measured;
  std::vector<identify::Response> responses;
  bool sweep = false;
  for (const std::string& file : options.files) {
    measured.inputs.push_back(read_fit_input(file, options.channel, options.trust_units));
    responses.push_back(measured.inputs.back().response);
    sweep = sweep || measured.inputs.back().sweep_file;
  }
  measured.response = responses.size() == 1 ? responses.front() : identify::merged(responses);
  if (options.hold == "auto") {
    const double rate_hz = measured.inputs.front().hold_hz;
    if (rate_hz == 0.0 && measured.inputs.front().rate_hz > 0.0)
      spdlog::info("{}: both signals are on the loop's side of its hold, so none is modelled",
                   measured.inputs.front().label);
    for (const FitInput& input : measured.inputs)
      if (input.hold_hz != rate_hz)
        throw std::invalid_argument(
            "fit: the files come from loops of different rates, so no one hold fits them all; fit "
            "them one by one, or give --hold none");
    if (rate_hz > 0.0) measured.hold_period_s = 1.0 / rate_hz;
  } else if (options.hold != "none") {
    const double rate_hz = number_of(options.hold, "--hold", "auto, none or a rate in Hz");
    if (rate_hz < 0.0)
      throw std::invalid_argument("--hold: the rate must be above zero, or 0 for no hold");
    if (rate_hz > 0.0) measured.hold_period_s = 1.0 / rate_hz;
  }
  measured.choose_model_error =
      sweep && !options.model_error && identify::has_scatter(measured.response);
  measured.model_error =
      options.model_error.value_or(measured.choose_model_error ? sweep_model_errors.back() : 0.0);
  return measured;
}

identify::FitOptions fit_options(const FitCommandOptions& options, const JointInput& measured) {
  identify::FitOptions fit;
  fit.path_delay_s = options.path_delay_s;
  fit.hold_period_s = measured.hold_period_s;
  fit.model_error = measured.model_error;
  fit.static_gain = options.static_gain;
  fit.stable = options.stable;
  fit.minimum_phase = options.minimum_phase;
  fit.robust = !options.keep_outliers;
  for (const double pole : options.given_poles_rad_s) fit.given_poles.emplace_back(pole);
  if (options.delay == "fit" || (options.delay.empty() && options.method == "ml")) {
    fit.delay = identify::Delay::fit;
  } else if (options.delay.empty()) {
    fit.delay = identify::Delay::none;
  } else if (options.delay != "none") {
    fit.delay = identify::Delay::known;
    fit.delay_s = number_of(options.delay, "--delay", "none, fit or seconds");
  }
  return fit;
}

}  // namespace sinerig::cli
