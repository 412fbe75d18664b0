// The frame layer under every simulated CAN servo: a bus that loses and delays on request.
#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "config/section.h"
#include "drivers/can/frame.h"
#include "drivers/can/socket.h"
#include "sim/motor.h"

namespace sinerig::sim {

struct ServoFaults {
  double lost_fraction = 0.0;   // of the replies
  double late_max_s = 0.0;      // each reply is late by up to this
  double silent_at_s = 0.0;     // from then on nothing is said; 0 = never
  double power_cycle_at_s = 0;  // forgets everything and boots for half a second; 0 = never
  double bus_off_at_s = 0.0;    // the controller reports bus-off; 0 = never …
  double bus_off_for_s = 0.0;   // … and its restart so much later; 0 = never
  double error_at_s = 0.0;      // the drive trips; 0 = never
  std::uint64_t seed = 1;
};

struct ServoSettings {
  std::string interface;
  std::string protocol;  // "odrive" or "mit"
  std::uint32_t node = 0;
  double feedback_s = 0.001;      // period of cyclic feedback; 0 = none
  bool reply_to_command = false;  // feedback as the answer to every set-point
  double watchdog_s = 0.0;        // without a frame for this long the drive trips; 0 = never
  double torque_max = 10.0;       // Nm
  double position_max = 12.5;     // rad, what the packed protocol can say
  double velocity_max = 30.0;     // rad/s
  std::uint32_t reply_id = 0;     // of the packed protocol
  LinearSystem system;
  ServoFaults faults;
};

// Reads [servo], [faults] and [plant]. Throws config::ConfigError.
ServoSettings read_servo(config::RigFile& file);

// What a protocol needs of the bus.
class Wire {
 public:
  Wire(can::Socket& socket, const ServoFaults& faults, std::int64_t start_ns);

  // Sends now, later or never, as the faults say.
  void reply(const can::Frame& frame, std::int64_t now_ns);

  // While it is cut nothing reaches the host.
  void cut(bool cut) noexcept { cut_ = cut; }

  // Sends what has become due; returns when the next is, or INT64_MAX.
  std::int64_t send_due(std::int64_t now_ns);

 private:
  struct Late {
    std::int64_t due_ns = 0;
    can::Frame frame;
  };

  can::Socket& socket_;
  ServoFaults faults_;
  std::int64_t start_ns_;
  std::mt19937_64 random_;
  std::vector<Late> late_;
  bool cut_ = false;
};

// One protocol: answers frames and speaks by itself.
class Protocol {
 public:
  virtual ~Protocol() = default;
  virtual void receive(const can::Frame& frame, std::int64_t time_ns) = 0;
  virtual void run(std::int64_t now_ns) = 0;     // whatever is due
  virtual std::int64_t next_due_ns() const = 0;  // INT64_MAX = nothing
  virtual void trip(std::int64_t now_ns) = 0;    // the drive finds an error
  virtual void power_cycle(std::int64_t now_ns) = 0;
};

std::unique_ptr<Protocol> make_odrive(const ServoSettings& settings, Motor& motor, Wire& wire,
                                      std::int64_t now_ns);
std::unique_ptr<Protocol> make_mit(const ServoSettings& settings, Motor& motor, Wire& wire,
                                   std::int64_t now_ns);

}  // namespace sinerig::sim
