#include "config/rig.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "config/limits.h"
#include "config/sweep_section.h"
#include "sweep/clock.h"
#include "sweep/records.h"

namespace sinerig::config {

namespace {

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
  if (!file->find("loop") && file->find("night")) {
    throw ConfigError(file->name() + ": is a job file, no rig file; `sinerig night " +
                      file->name() + "` runs it");
  }
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
