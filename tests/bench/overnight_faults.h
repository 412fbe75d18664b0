// What goes wrong in a simulated night, planted at known ticks in front of a simulated rig.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "drivers/driver.h"
#include "sweep/clock.h"
#include "sweep/retry.h"

namespace sinerig::bench {

enum class Ill : std::uint8_t {
  drive_trips,      // lets go and says so until it is armed again
  error_code,       // a health channel shows one until the drive is armed again
  connection_lost,  // neither commands nor readings for a while
  sensor_dead,      // one sensor says nothing for a while
  bump,             // somebody knocks the mechanism: a reading beyond its soft limit
  hot,              // a temperature beyond its soft limit
  command_lost,     // a single one
  gap,              // ticks that the loop sleeps through
};
constexpr std::size_t ill_kinds = 8;
const char* to_string(Ill ill);

struct Planted {
  Ill ill = Ill::gap;
  std::uint64_t tick = 0;   // at which the loop meets it
  std::uint64_t ticks = 0;  // that it lasts
  std::uint32_t failing_arms = 0;
  bool met = false;
};

// One in `every_s` on average, all kinds alike, so far apart that one is over before the next.
std::vector<Planted> plant_night(double hours, double rate_hz, double every_s, std::uint64_t seed);

// Sensors of the night's rig, in order.
constexpr std::size_t position_sensor = 0;
constexpr std::size_t velocity_sensor = 1;
constexpr std::size_t code_sensor = 2;
constexpr std::size_t temperature_sensor = 3;
constexpr std::size_t sensor_count = 4;

class Night;

// The grid with the planted gaps in it.
class NightClock final : public Clock {
 public:
  NightClock(double rate_hz, Night& night) : Clock{TickGrid{rate_hz}}, night_{night} {}
  Tick wait() noexcept override;
  Instant now() const noexcept override {
    return {.tick = next_ == 0 ? 0 : next_ - 1, .offset_ns = 0};
  }
  std::int64_t time_ns(Instant instant) const noexcept override {
    return grid().time_ns(instant.tick) + instant.offset_ns;
  }

 private:
  Night& night_;
  std::uint64_t next_ = 0;
};

// What has happened, exactly: what the events of the run are held against.
struct Diary {
  struct Reading {
    std::uint64_t tick = 0;
    std::size_t sensor = 0;
  };
  std::vector<std::uint64_t> faulty_writes;
  std::vector<Reading> sensor_faults;  // the first of a run of them
  std::uint32_t failed_arms = 0;
  std::uint32_t arms = 0;
};

// Stands in front of the actuator and the sensors of a rig. All calls come from the loop's thread.
class Night final : public Actuator, public Rearm {
 public:
  Night(std::vector<Planted> ills, double rate_hz);
  ~Night() override;

  // The rig behind it: position and velocity are its first two sensors.
  void stand_before(Actuator& actuator, Sensor& position, Sensor& velocity);

  Clock& clock() { return clock_; }
  Sensor& sensor(std::size_t index);
  const std::vector<Planted>& planted() const { return ills_; }
  const Diary& diary() const { return diary_; }

  Sample write(double command) noexcept override;
  void release() noexcept override { actuator_->release(); }
  std::string fault_reason(const Trip& trip) const override;
  std::string arm_again() override;

 private:
  friend class NightClock;
  class Probe;

  std::uint64_t skip_before(std::uint64_t tick) noexcept;
  void meet(std::uint64_t tick) noexcept;
  Sample read(std::size_t sensor) noexcept;
  Sample own(double value) const noexcept;
  std::uint64_t now() const noexcept { return clock_.now().tick; }

  std::vector<Planted> ills_;
  std::size_t next_ = 0;
  NightClock clock_;
  Actuator* actuator_ = nullptr;
  std::array<Sensor*, 2> plant_sensors_{};
  std::vector<std::unique_ptr<Probe>> probes_;
  std::array<Sample, sensor_count> last_{};
  std::array<bool, sensor_count> faulty_{};
  Diary diary_;

  bool tripped_ = false;
  double code_ = 0.0;
  bool lose_command_ = false;
  std::uint32_t failing_arms_ = 0;
  std::uint64_t lost_until_ = 0;
  std::uint64_t dead_until_ = 0;
  std::uint64_t bumped_until_ = 0;
  std::uint64_t hot_until_ = 0;
};

}  // namespace sinerig::bench
