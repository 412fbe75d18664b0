// A simulated servo at work on a CAN interface: hears every frame at its true time, answers as its
// protocol says, and goes wrong as its faults say.
#pragma once

#include <cstdint>
#include <memory>

#include "sim/can_servo/servo.h"

namespace sinerig::sim {

class ServoDevice {
 public:
  // Opens the interface. Throws std::runtime_error where there is none.
  explicit ServoDevice(ServoSettings settings);

  // What is due, then waits for a frame, for what is due next, or for `patience_ns` at most.
  void run_once(std::int64_t patience_ns);

 private:
  void cause_faults(std::int64_t now_ns);
  std::int64_t when(double at_s, bool done) const;
  std::int64_t next_fault_ns() const;
  double restarted_at_s() const;

  ServoSettings settings_;
  can::Socket socket_;
  std::int64_t start_ns_;
  Motor motor_;
  Wire wire_;
  std::unique_ptr<Protocol> protocol_;
  bool cycled_ = false;
  bool bus_off_ = false;
  bool restarted_ = false;
  bool tripped_ = false;
};

}  // namespace sinerig::sim
