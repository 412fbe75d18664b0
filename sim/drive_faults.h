// Faults of a simulated drive that a sweep may have to survive: it trips and wants to be armed
// again, the connection to it goes and comes back.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "drivers/driver.h"
#include "sweep/clock.h"

namespace sinerig::sim {

struct DriveFaultSettings {
  struct Span {
    double from_s = 0.0;
    double to_s = 0.0;
  };
  std::vector<double> trips_at_s;  // ascending; lets go and reports it until armed again
  std::uint32_t failing_arms = 0;  // after each trip so many attempts to arm it fail
  std::vector<Span> lost;          // ascending; commands are lost, no reading comes

  bool any() const { return !trips_at_s.empty() || !lost.empty(); }
};

// The state that the actuator and the sensors of one rig share. `clock` must outlive it.
class DriveFaults {
 public:
  static constexpr double tripped_code = 1.0;

  DriveFaults(DriveFaultSettings settings, const Clock& clock)
      : settings_{std::move(settings)}, clock_{clock} {}

  // Throws std::runtime_error where the drive does not come back yet.
  void arm();

  // Lets what is due happen.
  void look() noexcept SINERIG_NONBLOCKING;
  bool tripped() const noexcept { return tripped_; }
  bool lost() const noexcept { return lost_; }
  const Clock& clock() const noexcept { return clock_; }

 private:
  DriveFaultSettings settings_;
  const Clock& clock_;
  std::size_t next_trip_ = 0;
  std::size_t next_loss_ = 0;
  std::uint32_t failing_ = 0;
  bool tripped_ = false;
  bool lost_ = false;
};

// In front of an actuator: a drive that has tripped or hears nothing lets go.
class FaultyDrive final : public Actuator {
 public:
  FaultyDrive(Actuator& drive, DriveFaults& faults, double neutral)
      : drive_{drive}, faults_{faults}, neutral_{neutral} {}
  Sample write(double command) noexcept SINERIG_NONBLOCKING override;
  void release() noexcept override { drive_.release(); }

 private:
  Actuator& drive_;
  DriveFaults& faults_;
  double neutral_;
};

// In front of a sensor of the same device.
class FaultySensor final : public Sensor {
 public:
  FaultySensor(Sensor& sensor, const DriveFaults& faults) : sensor_{sensor}, faults_{faults} {}
  Sample read() noexcept SINERIG_NONBLOCKING override;

 private:
  Sensor& sensor_;
  const DriveFaults& faults_;
  Sample last_;
};

// What the drive says of itself: 0, or `tripped_code`.
class ErrorCode final : public Sensor {
 public:
  explicit ErrorCode(const DriveFaults& faults) : faults_{faults} {}
  Sample read() noexcept SINERIG_NONBLOCKING override;

 private:
  const DriveFaults& faults_;
};

}  // namespace sinerig::sim
