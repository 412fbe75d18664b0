#include "cli/fit_methods.h"

#include <complex>
#include <numbers>
#include <stdexcept>
#include <string>
#include <utility>

#include <spdlog/spdlog.h>

#include "identify/choe.h"
#include "identify/hassul.h"
#include "identify/hold.h"
#include "identify/least_squares_fit.h"
#include "identify/maximum_likelihood.h"
#include "identify/order.h"

namespace sinerig::cli {

namespace {

using identify::Response;

identify::Fit fitted(const JointInput& measured, identify::FitOptions options) {
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
std::vector<double> measured_band_edges(const JointInput& measured) {
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

identify::ChoeFit choe(const FitCommandOptions& options, const JointInput& measured,
                       const Response& response, const identify::HassulOrders& orders) {
  const std::vector<double> edges = measured_band_edges(measured);
  if (options.bands || edges.empty())
    return identify::fit_choe(response, orders, options.bands.value_or(usual_bands));
  spdlog::info("taking the {} sub-bands that were measured; --bands chooses others",
               edges.size() + 1);
  return identify::fit_choe(response, orders, edges);
}

}  // namespace

void fit_by_likelihood(const FitCommandOptions& options, const JointInput& measured,
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

void fit_by_paper(const FitCommandOptions& options, const JointInput& measured,
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

}  // namespace sinerig::cli
