// A plant with its actuator and sensors behind the driver interfaces: what stands in for the
// hardware. Runs on whatever clock the loop runs on, at the true time of each call.
//
// Per tick, in this order: the command is clamped, limited in slew, quantised and applied at the
// present instant; every sensor is sampled at its own instant (between now − delay − jitter and
// now − delay), at the present instant after the command, a controller's included; then noise,
// quantisation, loss are added to what each read() returns.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "drivers/driver.h"
#include "sim/controller.h"
#include "sim/imperfections.h"
#include "sim/plant.h"
#include "sweep/clock.h"

namespace sinerig::sim {

// What a sensor can read: an output of the plant or, with a controller around it, a signal of the
// loop.
enum class Signal : std::uint8_t { plant_output, error, control, plant_input };

struct SimulatedSensor {
  Signal signal = Signal::plant_output;
  std::size_t output = 0;  // row of the plant
  SensorImperfections imperfections;
};

struct SimulatedRigSettings {
  LinearSystem system;
  Friction friction;
  ActuatorImperfections actuator;
  std::vector<SimulatedSensor> sensors;
  double neutral = 0.0;
  std::uint64_t seed = 1;
  std::optional<ControllerSettings> controller;  // closes the loop around the plant
  std::size_t feedback = 0;                      // row of the plant that it controls
};

class SimulatedRig {
 public:
  // Throws std::invalid_argument where a setting is impossible. `clock` must outlive the rig.
  SimulatedRig(const SimulatedRigSettings& settings, const Clock& clock);
  ~SimulatedRig();

  Actuator& actuator() noexcept;
  Sensor& sensor(std::size_t index) noexcept;

 private:
  class Core;
  class Drive;
  class Probe;

  std::unique_ptr<Core> core_;
  std::unique_ptr<Drive> drive_;
  std::vector<std::unique_ptr<Probe>> probes_;
};

}  // namespace sinerig::sim
