#include "cli/drift_figures.h"

#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>

#include "cli/plant_model.h"
#include "identify/loop_analysis.h"

namespace sinerig::cli {

namespace {

using identify::Bounded;
using identify::LoopFigures;
using identify::Mode;

constexpr double lightly_damped = 0.3;  // above, a mode is no resonance
constexpr double same_mode = 0.1;       // of the frequency: a mode this near is the same one
constexpr double normal_975 = 1.959963984540054;
constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();

bool is_resonance(const Mode& mode) {
  return mode.pole.imag() > 0.0 && mode.damping.value > 0.0 && mode.damping.value < lightly_damped;
}

const Mode* nearest(const std::vector<Mode>& modes, double frequency_hz) {
  const Mode* best = nullptr;
  for (const Mode& mode : modes) {
    const double distance = std::abs(mode.frequency_hz.value - frequency_hz);
    if (!is_resonance(mode) || distance > same_mode * frequency_hz) continue;
    if (best == nullptr || distance < std::abs(best->frequency_hz.value - frequency_hz))
      best = &mode;
  }
  return best;
}

std::string at_hz(double frequency_hz) {
  char text[48];
  std::snprintf(text, sizeof text, "resonance at %.4g Hz", frequency_hz);
  return text;
}

void add_mode(report::Drift& drift, const Mode* first, const Mode* other) {
  const double frequency_hz = (first != nullptr ? first : other)->frequency_hz.value;
  const auto add = [&](const std::string& what, const std::string& unit,
                       identify::Estimate Mode::*figure) {
    const auto value = [&](const Mode* mode) {
      return mode == nullptr ? nan_value : (mode->*figure).value;
    };
    const auto half = [&](const Mode* mode) {
      return mode == nullptr ? nan_value : normal_975 * (mode->*figure).standard_error;
    };
    drift.figures.push_back(report::drift_figure(at_hz(frequency_hz) + what, unit, value(first),
                                                 half(first), value(other), half(other)));
  };
  add("", "Hz", &Mode::frequency_hz);
  if (first != nullptr && other != nullptr) add(", damping", "", &Mode::damping);
}

void add_bounded(report::Drift& drift, const std::string& name, const std::string& unit,
                 std::optional<Bounded> first, std::optional<Bounded> other) {
  if (!first && !other) return;
  const Bounded none{nan_value, nan_value, nan_value};
  const Bounded a = first.value_or(none);
  const Bounded b = other.value_or(none);
  drift.figures.push_back(report::drift_figure(name, unit, a.value, 0.5 * (a.high - a.low), b.value,
                                               0.5 * (b.high - b.low)));
}

LoopFigures loop_figures(const LoopOptions& options, const PlantModel& plant) {
  return identify::analyse_loop(model_curve(options, plant),
                                model_loop(options, plant).closed_loop_stable());
}

void add_margins(report::Drift& drift, const LoopFigures& first, const LoopFigures& other) {
  const auto of = [](const auto& margin, auto member) {
    return margin ? std::optional<Bounded>{(*margin).*member} : std::nullopt;
  };
  add_bounded(drift, "gain margin", "dB", of(first.gain_margin, &identify::GainMargin::margin_db),
              of(other.gain_margin, &identify::GainMargin::margin_db));
  add_bounded(drift, "phase margin", "deg",
              of(first.phase_margin, &identify::PhaseMargin::margin_deg),
              of(other.phase_margin, &identify::PhaseMargin::margin_deg));
  add_bounded(drift, "gain crossover", "Hz",
              of(first.phase_margin, &identify::PhaseMargin::frequency_hz),
              of(other.phase_margin, &identify::PhaseMargin::frequency_hz));
  add_bounded(drift, "delay margin", "s", of(first.delay_margin, &identify::PhaseMargin::delay_s),
              of(other.delay_margin, &identify::PhaseMargin::delay_s));
  add_bounded(drift, "sensitivity peak Ms", "", first.sensitivity_peak.peak,
              other.sensitivity_peak.peak);
}

}  // namespace

std::vector<report::Drift> drift_of(const std::vector<std::string>& files,
                                    const std::vector<std::string>& labels,
                                    const DriftSettings& settings) {
  const bool closed = has_controller(settings.loop);
  const PlantModel first =
      read_plant_model(files.front(), settings.channel, false, settings.loop.hold_hz);
  warn_of_unknown_hold(settings.loop, first.measured);
  const std::optional<LoopFigures> first_loop =
      closed ? std::optional{loop_figures(settings.loop, first)} : std::nullopt;
  std::vector<report::Drift> drifts;
  for (std::size_t i = 1; i < files.size(); ++i) {
    const PlantModel other =
        read_plant_model(files[i], settings.channel, false, settings.loop.hold_hz);
    report::Drift drift{.name = labels[i], .figures = {}};
    for (const Mode& mode : first.modes)
      if (is_resonance(mode)) add_mode(drift, &mode, nearest(other.modes, mode.frequency_hz.value));
    for (const Mode& mode : other.modes)
      if (is_resonance(mode) && nearest(first.modes, mode.frequency_hz.value) == nullptr)
        add_mode(drift, nullptr, &mode);
    if (first_loop) add_margins(drift, *first_loop, loop_figures(settings.loop, other));
    report::judge(drift, settings.false_alarm, settings.tolerance);
    drifts.push_back(std::move(drift));
  }
  return drifts;
}

}  // namespace sinerig::cli
