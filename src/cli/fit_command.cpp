#include "cli/fit_command.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <numbers>
#include <stdexcept>

#include <spdlog/spdlog.h>

#include "cli/commands.h"
#include "cli/fit_methods.h"
#include "cli/joint_input.h"
#include "identify/response.h"
#include "record/fit_store.h"
#include "report/fit_report.h"

namespace sinerig::cli {

namespace {

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
void look_at_stability(const FitCommandOptions& options, const JointInput& measured,
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

void add_discrete(const FitCommandOptions& options, const JointInput& measured,
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

void store(const FitCommandOptions& options, const JointInput& measured,
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
  const JointInput measured = read_joint_input(options);
  const FitInput& first = measured.inputs.front();
  report::FitReport report;
  report.method = options.method;
  report.response = measured.response;
  report.hold_period_s = measured.hold_period_s;
  report.path_delay_s = options.path_delay_s;
  report.label = first.label;
  for (std::size_t i = 1; i < measured.inputs.size(); ++i)
    report.label += " and " + measured.inputs[i].label;

  if (options.method == "ml" && !measured.response.empty() &&
      !identify::has_scatter(measured.response) && !(measured.model_error > 0.0))
    spdlog::warn(
        "{} holds no scatter: intervals come from the residual of the fit alone; fit --model-error "
        "says how far the points may be off",
        options.files.front());
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
