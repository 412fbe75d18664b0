#include "drivers/gpio/gpio_config.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>

namespace sinerig::gpio {
namespace {

using config::above_zero;
using config::any_number;
using config::Section;

constexpr config::Range some_ticks{.min = 1.0, .max = 1e6};

std::string text_of(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

// The lines named by `keys`; those listed by active_low are.
LineRequest read_lines(const Section& section, const std::vector<std::string>& keys) {
  LineRequest request;
  request.chip = section.text("chip");
  for (const std::string& key : keys) request.lines.push_back({.name = section.name_or_index(key)});
  for (const std::string& low :
       section.has("active_low") ? section.texts("active_low") : std::vector<std::string>{}) {
    const auto found = std::ranges::find(keys, low);
    if (found == keys.end()) {
      std::string known;
      for (const std::string& key : keys) known += " \"" + key + "\"";
      section.refuse("active_low", "\"" + low + "\" is no line of this channel; it has" + known);
    }
    request.lines[static_cast<std::size_t>(found - keys.begin())].active_low = true;
  }
  return request;
}

Bias read_bias(const Section& section) {
  const std::string name = section.choice("bias", {"as_is", "disabled", "pull_up", "pull_down"});
  if (name == "disabled") return Bias::disabled;
  if (name == "pull_up") return Bias::pull_up;
  if (name == "pull_down") return Bias::pull_down;
  return Bias::as_is;
}

// A command that the output can't follow must not get past the plan and the guard.
void require_limits_within(const config::Rig& rig, std::string_view key, double low, double high) {
  const MotionLimits& motion = rig.motion;
  if (motion.command_min >= low && motion.command_max <= high) return;
  rig.actuator.section.refuse(key, "the output gives " + text_of(low) + " to " + text_of(high) +
                                       ": set [limits] command_min and command_max within");
}

std::uint32_t read_ticks(const Section& section, std::string_view key) {
  return static_cast<std::uint32_t>(section.integer(key, some_ticks, 1));
}

double read_dither(const Section& section) {
  return section.number("dither", config::fraction_of_one, 0.5);
}

DensitySettings read_density(const config::Rig& rig, OutputSettings& output, bool can_disable) {
  const Section& section = rig.actuator.section;
  DensitySettings density;
  density.low = section.number("low", any_number, density.low);
  density.high = section.number("high", any_number, density.high);
  density.hold_ticks = read_ticks(section, "hold_ticks");
  density.dither = read_dither(section);
  output.safe_active = section.choice("safe", {"inactive", "active"}) == "active";
  if (density.low == density.high) section.refuse("high", "must differ from low");
  const double at_rest = output.safe_active ? density.high : density.low;
  if (at_rest != output.neutral && !can_disable)
    section.refuse("safe", "a line left " +
                               std::string{output.safe_active ? "active" : "inactive"} + " is " +
                               text_of(at_rest) + ", not the neutral " + text_of(output.neutral) +
                               ": choose the other level, set neutral, or give an enable_line");
  require_limits_within(rig, "high", std::min(density.low, density.high),
                        std::max(density.low, density.high));
  return density;
}

SignMagnitudeSettings read_sign_magnitude(const config::Rig& rig) {
  const Section& section = rig.actuator.section;
  SignMagnitudeSettings drive;
  drive.full = section.number("full", above_zero, drive.full);
  drive.hold_ticks = read_ticks(section, "hold_ticks");
  drive.dither = read_dither(section);
  drive.reversal_ticks = static_cast<std::uint32_t>(
      section.integer("reversal_ticks", {.min = 0.0, .max = 1e6}, drive.reversal_ticks));
  if (rig.guard.neutral != 0.0)
    section.refuse("neutral", "must be 0: that is what this output is when its line is inactive");
  require_limits_within(rig, "full", -drive.full, drive.full);
  return drive;
}

// A step takes a tick with the line active and one without.
StepSettings read_steps(const config::Rig& rig) {
  const Section& section = rig.actuator.section;
  StepSettings steps;
  steps.step = section.number("step", above_zero);
  steps.origin = rig.guard.neutral;
  const double fastest = rig.rate_hz / 2.0;
  const double steps_per_s =
      section.number("steps_per_s", {.min = 0.0, .max = fastest, .open_min = true}, fastest);
  steps.min_ticks = static_cast<std::uint32_t>(std::ceil(rig.rate_hz / steps_per_s * (1.0 - 1e-9)));
  const double speed = steps.step * rig.rate_hz / static_cast<double>(steps.min_ticks);
  if (!(rig.motion.velocity_max <= speed))
    section.refuse("steps_per_s", "the output moves by " + text_of(speed) +
                                      " per second at most: set [limits] velocity_max to that "
                                      "or less, so that the plan keeps to it");
  return steps;
}

}  // namespace

OutputPlan read_output(const config::Rig& rig) {
  const Section& section = rig.actuator.section;
  OutputPlan plan;
  plan.settings.neutral = rig.guard.neutral;
  const std::string kind = section.choice("output", {"density", "sign_magnitude", "step"});
  std::vector<std::string> keys{"line"};
  if (kind != "density") keys.emplace_back("direction_line");
  const bool can_disable = section.has("enable_line");
  if (can_disable) {
    plan.settings.enable = 1U << keys.size();
    keys.emplace_back("enable_line");
  }
  plan.lines = read_lines(section, keys);
  if (kind == "density") plan.modulator = read_density(rig, plan.settings, can_disable);
  if (kind == "sign_magnitude") plan.modulator = read_sign_magnitude(rig);
  if (kind == "step") plan.modulator = read_steps(rig);
  return plan;
}

SensorPlan read_sensor(const config::Channel& channel) {
  const Section& section = channel.section;
  SensorPlan plan;
  const std::string kind = section.choice("kind", {"encoder", "level", "interlock"});
  plan.lines = read_lines(section, kind == "encoder" ? std::vector<std::string>{"line_a", "line_b"}
                                                     : std::vector<std::string>{"line"});
  plan.lines.bias = read_bias(section);
  if (kind == "interlock") {
    plan.settings = InterlockSettings{};
  } else if (kind == "level") {
    LevelSettings level;
    level.low = section.number("low", any_number, level.low);
    level.high = section.number("high", any_number, level.high);
    plan.settings = level;
  } else {
    EncoderSettings encoder;
    encoder.scale = section.number("scale", any_number);
    if (encoder.scale == 0.0) section.refuse("scale", "must not be 0");
    encoder.offset = section.number("offset", any_number, encoder.offset);
    if (section.choice("samples", {"count", "edge"}) == "edge")
      encoder.samples = EncoderSettings::Samples::edge;
    encoder.lag_ns = std::llround(1e9 * section.number("lag_s", {.min = 0.0, .max = 0.1}, 1e-4));
    encoder.max_errors =
        static_cast<std::uint64_t>(section.integer("errors_max", {.min = 0.0, .max = 1e9}, 10));
    plan.settings = encoder;
  }
  return plan;
}

std::unique_ptr<Modulator> make_modulator(const ModulatorSettings& settings) {
  struct Make {
    std::unique_ptr<Modulator> operator()(const DensitySettings& density) const {
      return std::make_unique<DensityModulator>(density);
    }
    std::unique_ptr<Modulator> operator()(const SignMagnitudeSettings& drive) const {
      return std::make_unique<SignMagnitudeModulator>(drive);
    }
    std::unique_ptr<Modulator> operator()(const StepSettings& steps) const {
      return std::make_unique<StepModulator>(steps);
    }
  };
  return std::visit(Make{}, settings);
}

}  // namespace sinerig::gpio
