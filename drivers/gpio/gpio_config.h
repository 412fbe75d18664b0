// The keys of GPIO channels.
#pragma once

#include <memory>
#include <variant>

#include "config/rig.h"
#include "drivers/gpio/encoder.h"
#include "drivers/gpio/gpio_actuator.h"
#include "drivers/gpio/level.h"

namespace sinerig::gpio {

using ModulatorSettings = std::variant<DensitySettings, SignMagnitudeSettings, StepSettings>;

struct OutputPlan {
  LineRequest lines;  // the line, then those of direction and enable where there are
  ModulatorSettings modulator;
  OutputSettings settings;
};

struct InterlockSettings {};

struct SensorPlan {
  LineRequest lines;
  std::variant<EncoderSettings, LevelSettings, InterlockSettings> settings;
};

// Both throw config::ConfigError at the key that is wrong. An output whose limits allow what it
// cannot give, or whose safe level is not neutral, is refused.
OutputPlan read_output(const config::Rig& rig);
SensorPlan read_sensor(const config::Channel& channel);

std::unique_ptr<Modulator> make_modulator(const ModulatorSettings& settings);

}  // namespace sinerig::gpio
