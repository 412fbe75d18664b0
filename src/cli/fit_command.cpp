#include "cli/fit_command.h"

#include <cmath>
#include <iostream>
#include <sstream>
#include <stdexcept>

#include <spdlog/spdlog.h>

#include "cli/commands.h"
#include "cli/fit_input.h"
#include "identify/choe.h"
#include "identify/hassul.h"
#include "identify/hold.h"
#include "identify/maximum_likelihood.h"
#include "identify/order.h"
#include "identify/scatter.h"
#include "record/fit_store.h"
#include "report/fit_report.h"

namespace sinerig::cli {

namespace {

using identify::Response;

// A handful of blocks says little of its own scatter, and settling, quantisation and friction leave
// errors that repeat and so do not scatter at all: in config/gimbal.toml 0.3 % of a resonance is
// left after its settling time, and the intervals of a fit without this floor miss its damping.
constexpr double sweep_model_error = 2e-3;

double number_of(const std::string& text, const std::string& option, const std::string& wanted) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != '\0' || !std::isfinite(value))
    throw std::invalid_argument(option + " is \"" + text + "\"; wanted " + wanted);
  return value;
}

struct Measured {
  std::vector<FitInput> inputs;
  Response response;
  double hold_period_s = 0.0;
  double model_error = 0.0;
};

Measured measure(const FitCommandOptions& options) {
  Measured measured;
  std::vector<Response> responses;
  bool sweep = false;
  for (const std::string& file : options.files) {
    measured.inputs.push_back(read_fit_input(file, options.channel));
    responses.push_back(measured.inputs.back().response);
    sweep = sweep || measured.inputs.back().sweep_file;
  }
  measured.response = responses.size() == 1 ? responses.front() : identify::merged(responses);
  if (options.hold == "auto") {
    const double rate_hz = measured.inputs.front().rate_hz;
    for (const FitInput& input : measured.inputs)
      if (input.rate_hz != rate_hz)
        throw std::invalid_argument(
            "fit: the files come from loops of different rates, so no one hold fits them all; fit "
            "them one by one, or give --hold none");
    if (rate_hz > 0.0) measured.hold_period_s = 1.0 / rate_hz;
  } else if (options.hold != "none") {
    const double rate_hz = number_of(options.hold, "--hold", "auto, none or a rate in Hz");
    if (rate_hz <= 0.0) throw std::invalid_argument("--hold: the rate must be above zero");
    measured.hold_period_s = 1.0 / rate_hz;
  }
  measured.model_error = options.model_error.value_or(sweep ? sweep_model_error : 0.0);
  return measured;
}

identify::FitOptions fit_options(const FitCommandOptions& options, const Measured& measured) {
  identify::FitOptions fit;
  fit.path_delay_s = options.path_delay_s;
  fit.hold_period_s = measured.hold_period_s;
  fit.model_error = measured.model_error;
  fit.static_gain = options.static_gain;
  fit.stable = options.stable;
  fit.minimum_phase = options.minimum_phase;
  fit.robust = !options.keep_outliers;
  for (const double pole : options.given_poles_rad_s) fit.given_poles.emplace_back(pole);
  if (options.delay == "fit") {
    fit.delay = identify::Delay::fit;
  } else if (options.delay != "none") {
    fit.delay = identify::Delay::known;
    fit.delay_s = number_of(options.delay, "--delay", "none, fit or seconds");
  }
  return fit;
}

void fit_by_likelihood(const FitCommandOptions& options, const Measured& measured,
                       report::FitReport& report) {
  identify::FitOptions fit = fit_options(options, measured);
  const bool given = options.zeros && options.poles;
  if (given && options.order != "auto") {
    fit.zeros = *options.zeros;
    fit.poles = *options.poles;
    fit.origin = options.origin.value_or(0);
    report.fit = identify::fit_maximum_likelihood(measured.response, fit);
  } else {
    identify::OrderSettings settings;
    settings.fit = fit;
    settings.zeros = options.zeros;
    settings.poles = options.poles;
    settings.origin = options.origin;
    const identify::OrderSelection selection = identify::select_order(measured.response, settings);
    report.fit = selection.fit;
    report.table = selection.table;
  }
  report.model = report.fit->model;
}

// The paper's methods know neither delay nor hold: both are divided out of the data first.
Response without_known_parts(const identify::FitOptions& fit, Response response) {
  for (identify::ResponsePoint& point : response) {
    const double omega = point.omega_rad_s;
    std::complex<double> known = std::polar(1.0, -omega * (fit.delay_s + fit.path_delay_s));
    if (fit.hold_period_s > 0.0) known *= identify::hold_factor(omega, fit.hold_period_s);
    point.response /= known;
  }
  return response;
}

std::vector<double> hassul_weights(const std::string& weights, const Response& response) {
  if (weights == "none") return identify::unit_weights(response);
  if (weights == "1/w") return identify::inverse_frequency_weights(response);
  std::vector<double> listed;
  std::istringstream stream{weights};
  std::string field;
  while (std::getline(stream, field, ','))
    listed.push_back(number_of(field, "--weights", "none, 1/w, or one number per point"));
  return listed;
}

void fit_by_paper(const FitCommandOptions& options, const Measured& measured,
                  report::FitReport& report) {
  if (!options.zeros || !options.poles)
    throw std::invalid_argument("--method " + options.method +
                                " needs the orders; give --zeros and --poles, or use --method ml");
  const identify::FitOptions fit = fit_options(options, measured);
  if (fit.delay == identify::Delay::fit)
    spdlog::warn("--method {} cannot estimate a delay; none is assumed, --delay SECONDS gives one",
                 options.method);
  const int origin = options.origin.value_or(0);
  const identify::HassulOrders orders{*options.poles - std::max(origin, 0),
                                      *options.zeros - std::max(-origin, 0), origin};
  const Response response = without_known_parts(fit, measured.response);
  identify::check_response(response, 1);
  if (options.method == "choe") {
    report.choe = identify::fit_choe(response, orders, options.bands);
    report.model = report.choe->model;
  } else {
    report.model =
        identify::fit_hassul(response, orders, hassul_weights(options.weights, response));
  }
  report.model.delay_s = fit.delay_s;
}

}  // namespace

report::FitReport fit_files(const FitCommandOptions& options) {
  const Measured measured = measure(options);
  const FitInput& first = measured.inputs.front();
  report::FitReport report;
  report.method = options.method;
  report.response = measured.response;
  report.hold_period_s = measured.hold_period_s;
  report.path_delay_s = options.path_delay_s;
  report.label = first.label;
  for (std::size_t i = 1; i < measured.inputs.size(); ++i)
    report.label += " and " + measured.inputs[i].label;

  if (options.method == "ml")
    fit_by_likelihood(options, measured, report);
  else
    fit_by_paper(options, measured, report);

  if (measured.inputs.size() == 1 && first.sweep_file && !options.no_store) {
    record::store_fit(options.files.front(), first.input, first.output, options.method,
                      report::fit_json(report));
    spdlog::info("stored the fit in {}", options.files.front());
  }
  return report;
}

int fit_command(const FitCommandOptions& options) {
  const report::FitReport report = fit_files(options);
  if (options.json)
    std::cout << report::fit_json(report) << '\n';
  else
    report::print_fit(std::cout, report);
  if (report.fit && !report.fit->converged) {
    spdlog::warn("the fit has not converged: {}", report.fit->reason);
    return exit_failed;
  }
  return exit_done;
}

}  // namespace sinerig::cli
