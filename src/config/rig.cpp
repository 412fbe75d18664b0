#include "config/rig.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "config/limits.h"
#include "sweep/asked_frequencies.h"
#include "sweep/clock.h"
#include "sweep/records.h"

namespace sinerig::config {

namespace {

// Where the wait is fixed and nothing is said of its length.
constexpr Span default_fixed_wait{.cycles = 4.0, .seconds = 0.5};

double read_rate(const Section& loop) {
  const double rate_hz =
      loop.number("rate_hz", {.min = TickGrid::min_rate_hz, .max = TickGrid::max_rate_hz});
  if (std::abs(rate_hz * 1000.0 - std::round(rate_hz * 1000.0)) > 1e-6) {
    loop.refuse("rate_hz", "must be a whole number of millihertz");
  }
  return rate_hz;
}

ClockKind read_clock(const Section& loop, bool simulated) {
  if (!loop.has("clock")) return simulated ? ClockKind::virtual_time : ClockKind::monotonic;
  const std::string name = loop.choice("clock", {"virtual", "monotonic"});
  if (name == "virtual" && !simulated) {
    loop.refuse("clock", "needs every driver to be \"sim\"; hardware runs on \"monotonic\"");
  }
  return name == "virtual" ? ClockKind::virtual_time : ClockKind::monotonic;
}

realtime::Settings read_realtime(const Section& loop) {
  realtime::Settings settings;
  settings.priority =
      static_cast<int>(loop.integer("priority", {.min = 1.0, .max = 99.0}, settings.priority));
  if (const auto cpu = loop.integer("cpu", {.min = -1.0, .max = 1023.0}, -1); cpu >= 0)
    settings.cpu = static_cast<int>(cpu);
  return settings;
}

bool read_require_realtime(const Section& loop, ClockKind clock) {
  const bool required = loop.flag("require_realtime", false);
  if (required && clock == ClockKind::virtual_time)
    loop.refuse("require_realtime", "needs clock = \"monotonic\"; a virtual clock is never late");
  return required;
}

Range below_half(double rate_hz) {
  return {.min = 0.0, .max = rate_hz / 2.0, .open_min = true, .open_max = true};
}

double read_frequency(const Section& sweep, std::string_view key, double rate_hz) {
  const double frequency_hz = sweep.number(key, above_zero);
  if (!below_half(rate_hz).contains(frequency_hz)) {
    std::ostringstream rule;
    rule << "must be below half the loop rate (" << rate_hz / 2.0 << " Hz)";
    sweep.refuse(key, rule.str());
  }
  return frequency_hz;
}

constexpr Range point_count{.min = 1, .max = 100'000};

void read_sub_band_table(const Section& section, double rate_hz, SweepSettings& sweep) {
  for (const auto& row : section.rows("sub_band_table", above_zero)) {
    if (row.size() != 3)
      section.refuse("sub_band_table", "each row must be [start_hz, stop_hz, points]");
    if (!below_half(rate_hz).contains(row[0]) || !below_half(rate_hz).contains(row[1]))
      section.refuse("sub_band_table", "frequencies must be below half the loop rate");
    if (!point_count.contains(row[2]) || row[2] != std::floor(row[2]))
      section.refuse("sub_band_table", "points must be a whole number, 1 to 100000");
    if (row[2] > 1.0 && row[0] == row[1])
      section.refuse("sub_band_table",
                     "stop_hz must differ from start_hz in a row of several points");
    sweep.sub_bands.push_back(
        {.start_hz = row[0], .stop_hz = row[1], .points = static_cast<std::uint32_t>(row[2])});
  }
  if (sweep.sub_bands.empty()) section.refuse("sub_band_table", "must have a row");
}

void read_frequencies(const Section& section, double rate_hz, SweepSettings& sweep) {
  const std::string spacing = section.choice("spacing", {"logarithmic", "linear", "list"});
  if (spacing == "list") {
    sweep.spacing = Spacing::list;
    sweep.frequencies_hz = section.numbers("frequencies_hz", below_half(rate_hz));
    if (sweep.frequencies_hz.empty()) section.refuse("frequencies_hz", "must hold at least one");
    return;
  }
  sweep.spacing = spacing == "linear" ? Spacing::linear : Spacing::logarithmic;
  if (section.has("sub_band_table")) {
    read_sub_band_table(section, rate_hz, sweep);
    return;
  }
  sweep.start_hz = read_frequency(section, "start_hz", rate_hz);
  sweep.stop_hz = read_frequency(section, "stop_hz", rate_hz);
  sweep.points = static_cast<std::uint32_t>(section.integer("points", point_count));
  if (sweep.points > 1 && sweep.start_hz == sweep.stop_hz) {
    section.refuse("stop_hz", "must differ from start_hz when there is more than one point");
  }
  const auto sub_bands =
      static_cast<std::uint32_t>(section.integer("sub_bands", {.min = 1, .max = 100}, 1));
  if (sub_bands > 1) sweep.sub_bands = equal_sub_bands(sweep, sub_bands);
}

void read_amplitude(const Section& section, SweepSettings& sweep) {
  if (section.has("amplitude_table")) {
    if (section.has("amplitude")) {
      section.refuse("amplitude_table", "stands in place of amplitude; give one of the two");
    }
    for (const std::vector<double>& row : section.rows("amplitude_table", above_zero)) {
      if (row.size() != 2)
        section.refuse("amplitude_table", "every row is [frequency_hz, amplitude]");
      if (!sweep.amplitude_table.empty() && row[0] <= sweep.amplitude_table.back().frequency_hz) {
        section.refuse("amplitude_table", "the frequencies must rise");
      }
      sweep.amplitude_table.push_back({.frequency_hz = row[0], .amplitude = row[1]});
    }
    if (sweep.amplitude_table.empty()) section.refuse("amplitude_table", "must have a row");
  } else {
    sweep.amplitude = section.number("amplitude", above_zero);
  }
  sweep.follow_velocity = section.number("follow_velocity", above_zero_or_unlimited, unlimited);
  sweep.follow_acceleration =
      section.number("follow_acceleration", above_zero_or_unlimited, unlimited);
}

Span read_span(const Section& section, const std::string& name, Span fallback, Range range) {
  return {.cycles = section.number(name + "_cycles", range, fallback.cycles),
          .seconds = section.number(name + "_s", zero_or_more, fallback.seconds)};
}

Level read_level(const Section& section) {
  Level level;
  level.response = section.number("level", zero_or_more, level.response);
  if (!level.wanted()) return level;
  level.most_response = section.number("level_max", above_zero, 3.0 * level.response);
  if (level.most_response < level.response) section.refuse("level_max", "must not be below level");
  level.least_amplitude = section.number("amplitude_min", above_zero);
  level.retries = static_cast<std::uint32_t>(
      section.integer("retries", {.min = 0.0, .max = 10.0}, level.retries));
  return level;
}

Settling read_settling(const Section& section, const SweepSettings& sweep) {
  const std::string name = section.choice("settling", {"detect", "fixed", "model"});
  if (name == "fixed") return Settling::fixed;
  if (name == "detect") return Settling::detect;
  if (sweep.tones > 1) {
    section.refuse("settling",
                   "\"model\" measures one tone at a time; set tones = 1 or \"detect\"");
  }
  if (sweep.bias_amplitude > 0.0) {
    section.refuse("settling",
                   "\"model\" knows no bias motion; set bias_amplitude = 0 or \"detect\"");
  }
  return Settling::model;
}

SweepSettings read_sweep(const Section& section, double rate_hz) {
  SweepSettings sweep;
  read_frequencies(section, rate_hz, sweep);
  sweep.frequency_tolerance =
      section.number("frequency_tolerance", {.min = 1e-9, .max = 0.1}, sweep.frequency_tolerance);
  sweep.tones =
      static_cast<std::uint32_t>(section.integer("tones", {.min = 1.0, .max = 16.0}, sweep.tones));
  sweep.tones_tolerance =
      section.number("tones_tolerance", {.min = 1e-6, .max = 0.2}, sweep.tones_tolerance);
  sweep.odd_bins = section.flag("odd_bins", sweep.odd_bins);
  sweep.refine_points = static_cast<std::uint32_t>(
      section.integer("refine_points", {.min = 0.0, .max = 10'000.0}, sweep.refine_points));
  sweep.refine_db = section.number("refine_db", {.min = 0.001, .max = 60.0}, sweep.refine_db);
  read_amplitude(section, sweep);
  sweep.level = read_level(section);
  sweep.offset = section.number("offset", any_number, sweep.offset);
  sweep.bias_amplitude = section.number("bias_amplitude", zero_or_more, sweep.bias_amplitude);
  if (sweep.bias_amplitude > 0.0) sweep.bias_hz = read_frequency(section, "bias_hz", rate_hz);
  sweep.ramp_s = section.number("ramp_s", {.min = 0.0, .max = 3600.0}, sweep.ramp_s);
  sweep.settling = read_settling(section, sweep);
  sweep.probe_s = section.number("probe_s", {.min = -1.0, .max = 3600.0}, sweep.probe_s);
  sweep.check_fraction = section.number("check_fraction", fraction_of_one, sweep.check_fraction);
  if (sweep.settling == Settling::fixed) sweep.settle = default_fixed_wait;
  sweep.settle = read_span(section, "settle", sweep.settle, zero_or_more);
  sweep.settle_max = read_span(section, "settle_max", sweep.settle_max, zero_or_more);
  sweep.integrate = read_span(section, "integrate", sweep.integrate, zero_or_more);
  sweep.integrate_max = read_span(section, "integrate_max", sweep.integrate_max, zero_or_more);
  sweep.block = read_span(section, "block", sweep.block, {.min = 1.0});
  sweep.target_db = section.number("target_db", {.min = 0.0, .max = 20.0}, sweep.target_db);
  sweep.target_deg = section.number("target_deg", {.min = 0.0, .max = 90.0}, sweep.target_deg);
  sweep.target_of_first = section.choice("target_for", {"all", "first"}) == "first";
  sweep.harmonics = static_cast<std::uint32_t>(
      section.integer("harmonics", {.min = 1.0, .max = 16.0}, sweep.harmonics));
  sweep.max_distortion = section.number("max_distortion", above_zero, sweep.max_distortion);
  return sweep;
}

MotionLimits read_motion(const Section& limits) {
  MotionLimits motion;
  motion.command_min = limits.number("command_min", any_number, motion.command_min);
  motion.command_max = limits.number("command_max", any_number, motion.command_max);
  motion.slew_per_s = limits.number("slew_per_s", above_zero_or_unlimited, motion.slew_per_s);
  motion.velocity_max = limits.number("velocity_max", above_zero_or_unlimited, motion.velocity_max);
  motion.acceleration_max =
      limits.number("acceleration_max", above_zero_or_unlimited, motion.acceleration_max);
  if (!(motion.command_min < motion.command_max)) {
    limits.refuse("command_min", "must be below command_max");
  }
  return motion;
}

// Names and units go into files and tables where these end a field, a line or a name.
bool ends_a_field(const std::string& text) {
  return std::any_of(text.begin(), text.end(), [](char each) {
    return each == ',' || each == '"' || static_cast<unsigned char>(each) < 0x20 || each == 0x7F;
  });
}

void check_sensor_name(const Section& section, const std::string& name) {
  if (name.empty()) section.refuse("name", "the sensor has no name; call it [sensor.NAME]");
  if (name == "applied" || name == "command")
    section.refuse("name",
                   "\"" + name + "\" is the name of a channel that every rig has; choose another");
  if (ends_a_field(name) || name.find('/') != std::string::npos)
    section.refuse(
        "name", "a sensor's name must be without commas, quotes, slashes and control characters");
}

Channel read_channel(const Section& section, const std::string& name) {
  std::string unit = section.text("unit", "1");
  if (ends_a_field(unit))
    section.refuse("unit", "must be without commas, quotes and control characters");
  return {.name = name,
          .unit = std::move(unit),
          .driver = section.text("driver", "sim"),
          .section = section};
}

// "output/input" by the names of the sensors, and "applied".
Pairs read_responses(const Section& sweep, const std::vector<Channel>& sensors) {
  Pairs pairs;
  if (!sweep.has("responses")) return pairs;
  const auto channel = [&](const std::string& name) -> std::size_t {
    if (name == "applied") return 0;
    for (std::size_t i = 0; i < sensors.size(); ++i) {
      if (sensors[i].name == name) return 1 + i;
    }
    sweep.refuse("responses",
                 "there is no channel \"" + name + "\"; use \"applied\" or a sensor's name");
  };
  for (const std::string& text : sweep.texts("responses")) {
    const std::size_t slash = text.find('/');
    if (slash == std::string::npos) {
      sweep.refuse("responses", "\"" + text + "\" must be \"output/input\"");
    }
    const std::size_t output = channel(text.substr(0, slash));
    const std::size_t input = channel(text.substr(slash + 1));
    if (output == 0 || input == output) {
      sweep.refuse("responses", "\"" + text + "\" must be a sensor over another channel");
    }
    pairs.push_back({.input = input, .output = output, .exact_input = input == 0});
  }
  if (pairs.empty()) sweep.refuse("responses", "must hold at least one");
  return pairs;
}

}  // namespace

SweepPlan Rig::plan() const {
  try {
    return plan_sweep(sweep, motion, rate_hz);
  } catch (const PlanRefused& refused) {
    file->section(refused.section()).refuse(refused.key(), refused.what());
  }
}

std::vector<std::string> Rig::sensor_names() const {
  std::vector<std::string> names;
  for (const Channel& sensor : sensors) names.push_back(sensor.name);
  return names;
}

Rig read_rig(std::unique_ptr<RigFile> file) {
  const Section loop = file->section("loop");
  const Section sweep = file->section("sweep");
  const Section limits = file->section("limits");
  Rig rig{.file = nullptr, .actuator = read_channel(file->section("actuator"), "command")};
  for (const Section& section : file->children("sensor")) {
    const std::string name = section.name().substr(sizeof "sensor");
    check_sensor_name(section, name);
    rig.sensors.push_back(read_channel(section, name));
    rig.sensors.back().health = section.flag("health", false);
  }
  if (rig.sensors.empty()) {
    throw ConfigError(file->name() + ": there is no sensor; add a section [sensor.NAME]");
  }
  if (rig.sensors.size() > max_channels - first_sensor_channel) {
    throw ConfigError(file->name() + ": at most 14 sensors can be read in one run");
  }

  const bool simulated = rig.actuator.driver == "sim" &&
                         std::all_of(rig.sensors.begin(), rig.sensors.end(),
                                     [](const Channel& sensor) { return sensor.driver == "sim"; });
  rig.rate_hz = read_rate(loop);
  rig.clock = read_clock(loop, simulated);
  rig.realtime = read_realtime(loop);
  rig.require_realtime = read_require_realtime(loop, rig.clock);
  rig.sweep = read_sweep(sweep, rig.rate_hz);
  rig.motion = read_motion(limits);
  rig.guard = read_guard(limits, rig.motion, rig.rate_hz);
  rig.guard.neutral = rig.actuator.section.number("neutral", any_number, 0.0);
  if (rig.guard.neutral < rig.motion.command_min || rig.guard.neutral > rig.motion.command_max) {
    rig.actuator.section.refuse("neutral", "must lie between [limits] command_min and command_max");
  }
  rig.sweep.neutral = rig.guard.neutral;
  for (const Channel& sensor : rig.sensors) {
    rig.guard.channels.push_back(
        read_channel_limits(sensor.section, rig.rate_hz, sensor.unit == rig.actuator.unit));
  }
  rig.runner.max_gap_s = loop.number("max_gap_s", {.min = 0.001, .max = 3600.0}, 1.0);
  rig.runner.preflight = read_preflight(sweep);
  if (const auto retry = file->find("retry")) rig.runner.retry = read_retry(*retry);
  if (const auto output = file->find("output")) {
    rig.runner.record_samples = output->flag("samples", false);
    rig.max_lag_s = output->number("max_lag_s", {.min = 0.01, .max = 3600.0}, rig.max_lag_s);
  }
  for (std::size_t i = 0; i < rig.sensors.size(); ++i) {
    if (rig.sensors[i].section.flag("readback", false)) rig.runner.readbacks.push_back(i);
  }
  rig.runner.responses = read_responses(sweep, rig.sensors);
  rig.prior = sweep.text("prior", "");
  if (rig.sweep.settling == Settling::model) {
    for (const Pair& pair : rig.runner.responses) {
      if (pair.exact_input) continue;
      sweep.refuse("settling",
                   "\"model\" needs responses to \"applied\": the transient of a measured input "
                   "is not modelled; use \"detect\"");
    }
  } else if (!rig.prior.empty()) {
    sweep.refuse("prior", "belongs to settling = \"model\"");
  }
  rig.file = std::move(file);
  return rig;
}

}  // namespace sinerig::config
