#include "cli/notch_command.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <numbers>
#include <sstream>
#include <stdexcept>

#include "cli/commands.h"

namespace sinerig::cli {

namespace {

using identify::Mode;

constexpr double named_within = 0.1;           // of the frequency: a mode this near is meant
constexpr double lightly_damped = 0.3;         // above, a mode is no resonance to notch
constexpr double plain_attenuation_db = 20.0;  // without a controller
constexpr double peak_below_db = -12.0;        // where the peak of L comes to, with one
constexpr double least_attenuation_db = 6.0;
constexpr double plain_crossover = 0.25;  // of the resonance, without a controller

bool is_resonance(const Mode& mode) {
  return mode.pole.imag() > 0.0 && mode.damping.value > 0.0 && mode.damping.value < lightly_damped;
}

std::string resonances_text(const PlantModel& plant) {
  std::ostringstream text;
  text.precision(5);
  for (const Mode& mode : plant.modes)
    if (is_resonance(mode)) text << ' ' << mode.frequency_hz.value;
  return text.str().empty() ? " none" : text.str();
}

const Mode& mode_near(const PlantModel& plant, const std::string& file, double frequency_hz) {
  const Mode* nearest = nullptr;
  const auto distance = [&](const Mode& mode) {
    return std::abs(mode.frequency_hz.value - frequency_hz);
  };
  for (const Mode& mode : plant.modes)
    if (is_resonance(mode) && (nearest == nullptr || distance(mode) < distance(*nearest)))
      nearest = &mode;
  if (nearest == nullptr || distance(*nearest) > named_within * frequency_hz) {
    std::ostringstream message;
    message << file << ": the model has no resonance near " << frequency_hz << " Hz; it has"
            << resonances_text(plant);
    throw std::invalid_argument(message.str());
  }
  return *nearest;
}

std::vector<double> wanted_frequencies(const NotchOptions& options, const PlantModel& plant) {
  if (!options.at_hz.empty()) {
    std::vector<double> sorted = options.at_hz;
    std::sort(sorted.begin(), sorted.end());
    return sorted;
  }
  for (const Mode& mode : plant.modes)
    if (is_resonance(mode)) return {mode.frequency_hz.value};
  throw std::invalid_argument(
      options.files.front() +
      ": the model has no lightly damped mode, so there is nothing to notch");
}

identify::UncertainMode interval_of(const NotchOptions& options,
                                    const std::vector<PlantModel>& plants, double frequency_hz) {
  std::vector<Mode> modes;
  for (std::size_t i = 0; i < plants.size(); ++i)
    modes.push_back(mode_near(plants[i], options.files[i], frequency_hz));
  identify::UncertainMode mode = identify::uncertain_mode(modes);
  if (options.within_hz >= mode.low_hz) {
    std::ostringstream message;
    message << "--within " << options.within_hz << ": must be below the resonance at "
            << mode.frequency_hz << " Hz";
    throw std::invalid_argument(message.str());
  }
  mode.low_hz -= options.within_hz;
  mode.high_hz += options.within_hz;
  mode.frequency_hz = std::sqrt(std::max(mode.low_hz, 0.0) * mode.high_hz);
  return mode;
}

identify::LoopFigures figures_of(const identify::LoopModel& loop, const PlantModel& plant) {
  return identify::analyse_loop(searched_curve(loop, plant), loop.closed_loop_stable());
}

identify::NotchRequest request_for(const NotchOptions& options, const identify::UncertainMode& mode,
                                   const identify::LoopModel& loop,
                                   const identify::LoopFigures& figures) {
  const bool closed = has_controller(options.loop);
  identify::NotchRequest request;
  request.rate_hz = loop.rate_hz();
  request.crossover_hz = plain_crossover * mode.low_hz;
  request.attenuation_db = plain_attenuation_db;
  if (closed) {
    if (!figures.gain_crossings.empty())
      request.crossover_hz = figures.gain_crossings.front().frequency_hz.value;
    double peak_db = -INFINITY;
    for (const identify::Resonance& each : figures.resonances)
      if (std::abs(each.frequency_hz / mode.frequency_hz - 1.0) < named_within)
        peak_db = std::max(peak_db, each.gain_db.high);
    request.attenuation_db = std::max(least_attenuation_db, peak_db - peak_below_db);
  }
  request.attenuation_db = options.attenuation_db.value_or(request.attenuation_db);
  request.crossover_hz = options.crossover_hz.value_or(request.crossover_hz);
  return request;
}

std::pair<int, int> fixed_format(const std::string& text) {
  int whole = 0;
  int fraction = 0;
  char rest = '\0';
  if (std::sscanf(text.c_str(), "%d.%d%c", &whole, &fraction, &rest) != 2)
    throw std::invalid_argument("--fixed is \"" + text +
                                "\"; wanted INTEGER.FRACTION bits, for example 2.30");
  return {whole + fraction, fraction};
}

}  // namespace

NotchedLoop design_notches(const NotchOptions& options) {
  if (!options.loop.controller_file.empty())
    throw std::invalid_argument("notch needs the controller as a transfer function or PID");
  std::vector<PlantModel> plants;
  for (const std::string& file : options.files)
    plants.push_back(read_plant_model(file, options.channel, options.refit, options.loop.hold_hz,
                                      options.loop.trust_units));
  const PlantModel& plant = plants.front();
  warn_of_unknown_hold(options.loop, plant.measured);
  const auto [bits, fraction_bits] = fixed_format(options.fixed);

  LoopOptions loop_options = options.loop;
  if (!loop_options.rate_hz && plant.measured.rate_hz > 0.0)
    loop_options.rate_hz = plant.measured.rate_hz;
  const identify::LoopModel bare = model_loop(loop_options, plant);
  identify::LoopModel loop = bare;
  report::NotchReport report;
  report.label = plant.measured.label;
  report.controller = controller_text(options.loop);
  report.rate_hz = loop.rate_hz();
  const bool closed = has_controller(options.loop);
  identify::LoopFigures figures = figures_of(loop, plant);
  if (closed) report.before = report::NotchReport::Loop{figures, loop.closed_loop_stable()};
  for (const double frequency_hz : wanted_frequencies(options, plant)) {
    report::DesignedNotch designed;
    designed.mode = interval_of(options, plants, frequency_hz);
    designed.request = request_for(options, designed.mode, loop, figures);
    designed.design = identify::design_notch(designed.mode, designed.request);
    if (loop.rate_hz() > 0.0) {
      designed.biquad = identify::biquad_of(designed.design.notch);
      designed.fixed = identify::quantised(*designed.biquad, bits, fraction_bits);
    }
    loop = loop.with(designed.design.notch);
    figures = figures_of(loop, plant);
    report.notches.push_back(designed);
  }
  if (closed) report.after = report::NotchReport::Loop{figures, loop.closed_loop_stable()};
  return {.report = report, .before = bare, .after = loop};
}

int notch_command(const NotchOptions& options) {
  const report::NotchReport report = design_notches(options).report;
  if (options.format == "json")
    std::cout << report::notch_json(report) << '\n';
  else if (options.format == "c")
    report::print_notch_c(std::cout, report);
  else
    report::print_notch(std::cout, report);
  return exit_done;
}

}  // namespace sinerig::cli
