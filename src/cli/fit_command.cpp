#include "cli/fit_command.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <numbers>
#include <stdexcept>

#include <spdlog/spdlog.h>

#include "cli/commands.h"
#include "cli/fit_input.h"
#include "identify/choe.h"
#include "identify/hassul.h"
#include "identify/hold.h"
#include "identify/least_squares_fit.h"
#include "identify/maximum_likelihood.h"
#include "identify/order.h"
#include "identify/scatter.h"
#include "record/fit_store.h"
#include "report/fit_report.h"

namespace sinerig::cli {

namespace {

using identify::Response;

// Settling, quantisation and friction leave errors that repeat and so do not scatter at all; a fit
// weighted by the scatter alone would say that it knows the plant better than it does. The least of
// these relative errors that makes the residual what noise leaves is taken; the largest chooses the
// order. On config/gimbal.toml 1e-4 is enough: of 24 seeds every interval of frequency, damping and
// delay holds the truth, where the largest makes them twenty times too wide.
constexpr std::array<double, 5> sweep_model_errors{1e-4, 2e-4, 5e-4, 1e-3, 2e-3};

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
  bool choose_model_error = false;
};

Measured measure(const FitCommandOptions& options) {
  Measured measured;
  std::vector<Response> responses;
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
  measured.model_error = options.model_error.value_or(sweep ? sweep_model_errors.back() : 0.0);
  measured.choose_model_error =
      sweep && !options.model_error && identify::has_scatter(measured.response);
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

identify::Fit fitted(const Measured& measured, identify::FitOptions options) {
  identify::Fit fit = identify::fit_maximum_likelihood(measured.response, options);
  if (!measured.choose_model_error) return fit;
  for (const double model_error : sweep_model_errors) {
    if (model_error >= options.model_error) break;
    identify::FitOptions sharper = options;
    sharper.model_error = model_error;
    const identify::Fit trial = identify::fit_maximum_likelihood(measured.response, sharper);
    if (trial.converged && trial.chi2 <= trial.chi2_high &&
        trial.outliers.size() <= fit.outliers.size())
      return trial;
  }
  return fit;
}

void refuse_bands(const FitCommandOptions& options) {
  if (options.bands)
    throw std::invalid_argument("--bands belongs to --method choe; --method " + options.method +
                                " fits all points at once");
}

// Of the papers' methods: their least squares are linear and know no such conditions.
void refuse_conditions(const FitCommandOptions& options) {
  const auto refuse = [&](bool given, const std::string& option) {
    if (given)
      throw std::invalid_argument(option + " belongs to --method ml; --method " + options.method +
                                  " cannot keep to it");
  };
  refuse(options.stable, "--stable");
  refuse(options.minimum_phase, "--minimum-phase");
  refuse(!options.given_poles_rad_s.empty(), "--given-pole");
  refuse(options.static_gain.has_value(), "--static-gain");
}

void fit_by_likelihood(const FitCommandOptions& options, const Measured& measured,
                       report::FitReport& report) {
  if (options.weights.given())
    throw std::invalid_argument("--weights belongs to --method hassul; ml weighs by the scatter");
  refuse_bands(options);
  identify::FitOptions fit = fit_options(options, measured);
  const bool given = options.zeros && options.poles;
  const bool proper = measured.hold_period_s == 0.0 || !given || *options.zeros <= *options.poles;
  if (given && options.order != "auto" && (options.origin || !proper)) {
    fit.zeros = *options.zeros;
    fit.poles = *options.poles;
    fit.origin = options.origin.value_or(0);
  } else {
    identify::OrderSettings settings;
    settings.fit = fit;
    settings.zeros = options.zeros;
    settings.poles = options.poles;
    settings.origin = options.origin;
    const identify::OrderSelection selection = identify::select_order(measured.response, settings);
    report.table = selection.table;
    fit = selection.chosen;
  }
  report.fit = fitted(measured, fit);
}

// The poles of a fit that grow, as text in Hz; empty where none does.
std::string growing_poles(const identify::Fit& fit) {
  std::string text;
  for (const std::complex<double> pole : fit.zpk.poles) {
    if (pole.real() <= 0.0 || pole.imag() < 0.0) continue;
    char number[48];
    std::snprintf(number, sizeof number, "%.3g Hz", std::abs(pole) / (2.0 * std::numbers::pi));
    text += (text.empty() ? "" : ", ") + std::string{number};
  }
  return text;
}

// A rig that was swept in open loop and stood it is stable, whatever a fit makes of its friction,
// its noise or an order too high.
void look_at_stability(const FitCommandOptions& options, const Measured& measured,
                       report::FitReport& report) {
  const bool open_loop = std::all_of(measured.inputs.begin(), measured.inputs.end(),
                                     [](const FitInput& input) { return input.driven_by_command; });
  const std::string growing = growing_poles(report.fit);
  if (growing.empty() || !open_loop) return;
  if (!options.stable_in_open_loop || options.method != "ml") {
    spdlog::warn(
        "the model is unstable (poles in the right half plane at {}), but what was swept in open "
        "loop without running away is not: margins of this model mislead; fit with {}--stable, or "
        "with lower orders",
        growing, options.method == "ml" ? "" : "--method ml ");
    return;
  }
  spdlog::info("the free fit has poles in the right half plane at {}; fitting with --stable",
               growing);
  FitCommandOptions stable = options;
  stable.stable = true;
  fit_by_likelihood(stable, measured, report);
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

// Of the sweep by sub-bands, or of files that were measured one sub-band each.
std::vector<double> measured_band_edges(const Measured& measured) {
  if (measured.inputs.size() == 1) return measured.inputs.front().band_edges_rad_s;
  std::vector<std::pair<double, double>> reach;
  for (const FitInput& input : measured.inputs) {
    if (input.response.empty()) return {};
    constexpr double turn = 2.0 * std::numbers::pi;
    reach.emplace_back(input.response.front().omega_rad_s / turn,
                       input.response.back().omega_rad_s / turn);
  }
  return edges_between(reach);
}

constexpr int usual_bands = 3;

identify::ChoeFit choe(const FitCommandOptions& options, const Measured& measured,
                       const Response& response, const identify::HassulOrders& orders) {
  const std::vector<double> edges = measured_band_edges(measured);
  if (options.bands || edges.empty())
    return identify::fit_choe(response, orders, options.bands.value_or(usual_bands));
  spdlog::info("taking the {} sub-bands that were measured; --bands chooses others",
               edges.size() + 1);
  return identify::fit_choe(response, orders, edges);
}

void fit_by_paper(const FitCommandOptions& options, const Measured& measured,
                  report::FitReport& report) {
  if (!options.zeros || !options.poles || options.order == "auto")
    throw std::invalid_argument("--method " + options.method +
                                " needs the orders; give --zeros and --poles, or use --method ml");
  if (options.method == "choe" && options.weights.given())
    throw std::invalid_argument("--method choe makes its own weights; leave --weights out");
  refuse_conditions(options);
  if (options.method != "choe") refuse_bands(options);
  identify::FitOptions fit = fit_options(options, measured);
  fit.model_error = options.model_error.value_or(0.0);
  if (fit.delay == identify::Delay::fit) {
    spdlog::warn("--method {} cannot estimate a delay; none is assumed, --delay SECONDS gives one",
                 options.method);
    fit.delay = identify::Delay::none;
  }
  const int origin = options.origin.value_or(0);
  const identify::HassulOrders orders{*options.poles - std::max(origin, 0),
                                      *options.zeros - std::max(-origin, 0), origin};
  const Response response = without_known_parts(fit, measured.response);
  identify::check_response(response, 1);
  std::vector<double> weights;
  identify::TransferFunction model;
  if (options.method == "choe") {
    report.choe = choe(options, measured, response, orders);
    model = report.choe->model;
    weights = report.choe->weight;
  } else {
    const std::vector<double> column =
        measured.inputs.size() == 1 ? measured.inputs.front().weights : std::vector<double>{};
    weights = weights_of(options.weights, column, response);
    model = identify::fit_hassul(response, orders, weights);
  }
  report.fit = identify::describe_least_squares(measured.response, fit, orders, model, weights);
}

void add_discrete(const FitCommandOptions& options, const Measured& measured,
                  report::FitReport& report) {
  if (options.discrete.empty()) {
    if (options.rate_hz > 0.0 || options.prewarp_hz > 0.0)
      throw std::invalid_argument("--rate and --prewarp belong to --discrete");
    return;
  }
  const double loop_hz = measured.inputs.front().rate_hz;
  const double rate_hz = options.rate_hz > 0.0 ? options.rate_hz : loop_hz;
  if (!(rate_hz > 0.0))
    throw std::invalid_argument("--discrete needs the rate it is to run at; give --rate HZ");
  report.discrete = {.method = options.discrete,
                     .period_s = 1.0 / rate_hz,
                     .prewarp_rad_s = 2.0 * std::numbers::pi * options.prewarp_hz};
  report::discrete_equivalent(*report.discrete, report.fit.zpk);
}

void store(const FitCommandOptions& options, const Measured& measured,
           const report::FitReport& report) {
  if (options.no_store) return;
  for (std::size_t i = 0; i < measured.inputs.size(); ++i) {
    const FitInput& input = measured.inputs[i];
    if (!input.sweep_file) continue;
    try {
      record::store_fit(options.files[i], input.input, input.output, options.method,
                        report::fit_json(report));
      spdlog::info("stored the fit in {}", options.files[i]);
    } catch (const record::SweepFileError& refused) {
      // A file that may only be read is fitted all the same, each time anew.
      spdlog::warn("the fit is not stored: {}", refused.what());
    }
  }
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

  try {
    if (options.method == "ml")
      fit_by_likelihood(options, measured, report);
    else
      fit_by_paper(options, measured, report);
  } catch (const std::invalid_argument& refused) {
    const std::string what = refused.what();
    if (!what.starts_with("response: ")) throw;
    throw std::invalid_argument(options.files.front() + ": " + what);
  }
  look_at_stability(options, measured, report);

  add_discrete(options, measured, report);
  store(options, measured, report);
  return report;
}

int fit_command(const FitCommandOptions& options) {
  const report::FitReport report = fit_files(options);
  if (options.json)
    std::cout << report::fit_json(report) << '\n';
  else
    report::print_fit(std::cout, report);
  if (!report.fit.converged) {
    spdlog::warn("the fit has not converged: {}", report.fit.reason);
    return exit_failed;
  }
  return exit_done;
}

}  // namespace sinerig::cli
