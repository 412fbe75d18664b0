// The mechanics on the shaft of every simulated drive that sits on a bus.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "sim/plant.h"

namespace sinerig::sim {

// Torque in at a time, angle and rate out at a time. Times are CLOCK_MONOTONIC. However fast
// torques come and however seldom the shaft is looked at, each acts for its own time, after the
// dead time.
class Motor {
 public:
  // Throws std::invalid_argument for a system without the outputs position and velocity.
  Motor(const LinearSystem& system, std::int64_t start_ns);

  void apply(double torque, std::int64_t time_ns);
  void sample(std::int64_t time_ns);

  double position() const { return outputs_[position_]; }  // rad, at the last sample
  double velocity() const { return outputs_[velocity_]; }
  double torque() const { return torque_; }

 private:
  PlantTime plant_time(std::int64_t time_ns);

  std::int64_t start_ns_;
  std::int64_t last_ns_;
  Plant plant_;
  std::size_t position_ = 0;
  std::size_t velocity_ = 0;
  std::vector<double> outputs_;
  double torque_ = 0.0;
};

}  // namespace sinerig::sim
