#include "cli/margins_command.h"

#include <iostream>
#include <stdexcept>

#include <nlohmann/json.hpp>
#include <spdlog/spdlog.h>

#include "cli/commands.h"
#include "identify/loop_analysis.h"
#include "identify/loop_conversions.h"
#include "report/loop_report.h"

namespace sinerig::cli {

namespace {

using identify::LoopSignal;

// T comes to 1 where the loop gain is high. A closed loop that was measured was stable, so L has a
// phase margin above zero, or with the other sign has not.
bool sign_is_suspect(const FitInput& measured, LoopSignal signal,
                     const identify::LoopFigures& figures) {
  const identify::Response& points = measured.response;
  if (signal == LoopSignal::complementary) return points.front().response.real() < -0.5;
  if (signal != LoopSignal::loop || !figures.phase_margin) return false;
  identify::Response other = points;
  for (identify::ResponsePoint& point : other) point.response = -point.response;
  const auto negated = identify::analyse_loop(identify::Curve::of_points(other)).phase_margin;
  return figures.phase_margin->margin_deg.value < 0.0 && negated && negated->margin_deg.value > 0.0;
}

}  // namespace

int margins_command(const MarginsOptions& options) {
  const identify::LoopSignal signal = identify::loop_signal(options.response);
  const bool plant = signal == identify::LoopSignal::plant;
  if (!plant && has_controller(options.loop))
    throw std::invalid_argument("--response " + options.response +
                                " holds the controller already; leave it out");
  FitInput measured = read_fit_input(options.file, options.channel, options.loop.trust_units);
  if (options.loop.hold_hz) take_hold(measured, *options.loop.hold_hz);
  if (plant) warn_of_unknown_hold(options.loop, measured);
  identify::check_response(measured.response, 2);
  if (options.negate)
    for (identify::ResponsePoint& point : measured.response) point.response = -point.response;
  const identify::Curve points =
      plant ? measured_loop(options.loop, measured)
            : identify::loop_from(identify::Curve::of_points(measured.response), signal);
  const identify::LoopFigures of_points = identify::analyse_loop(points);
  if (sign_is_suspect(measured, signal, of_points))
    spdlog::warn("{}: this loop stood while it was measured, but not with this sign; {}",
                 measured.label,
                 options.negate ? "leave --negate out"
                                : "a response measured as minus L or minus T wants --negate");

  const double rate_hz = plant ? loop_rate_hz(options.loop, measured) : 0.0;
  nlohmann::ordered_json json{{"label", measured.label},
                              {"response", options.response},
                              {"controller", controller_text(options.loop)},
                              {"rate_hz", rate_hz},
                              {"points", report::loop_json(of_points, std::nullopt)},
                              {"model", nullptr}};
  if (!options.json) {
    std::cout << measured.label << ", " << controller_text(options.loop);
    if (rate_hz > 0.0) std::cout << " at " << rate_hz << " Hz";
    std::cout << "; in brackets 95 % intervals\n\n";
  }
  if (plant && !options.points_only) {
    PlantModel model = read_plant_model(options.file, options.channel, options.refit,
                                        options.loop.hold_hz, options.loop.trust_units);
    if (options.negate) model.zpk.gain = -model.zpk.gain;
    std::optional<bool> stable;
    if (options.loop.controller_file.empty())
      stable = model_loop(options.loop, model).closed_loop_stable();
    const identify::LoopFigures of_model =
        identify::analyse_loop(model_curve(options.loop, model), stable);
    json["model"] = report::loop_json(of_model, stable);
    if (!options.json) {
      report::print_loop(std::cout, "model", of_model, stable);
      std::cout << '\n';
    }
  }
  if (options.json)
    std::cout << json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) << '\n';
  else
    report::print_loop(std::cout, "points (their scatter only, not what lies between neighbours)",
                       of_points, std::nullopt);
  return exit_done;
}

}  // namespace sinerig::cli
