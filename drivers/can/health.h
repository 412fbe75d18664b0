// Watches what a device says about itself: a state that must stay, an error code that must be 0, a
// heartbeat that must come.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "drivers/can/bus.h"

namespace sinerig::can {

struct HealthRule {
  enum class Operator : std::uint8_t { equal, not_equal, at_most, at_least };

  std::string name;  // "axis_state"
  Pattern pattern;
  Checksum checksum;
  Signal signal;
  Operator comparison = Operator::equal;
  double value = 0.0;           // to be equal to, or not: what decode() makes of its code
  bool fd = false;              // comes in a CAN-FD frame
  std::int64_t max_age_ns = 0;  // of the newest frame; 0 = not watched
  std::size_t slot = 0;         // given by Health
};

class Health {
 public:
  // Has the bus listen for every rule. Before Bus::start().
  Health(Bus& bus, std::vector<HealthRule> rules);

  // From now on frames are expected; what came before does not count.
  void begin() noexcept;

  // Silence counts from `now_ns` on; what has been said since begin() stands.
  void begin_ages(std::int64_t now_ns) noexcept SINERIG_NONBLOCKING { begin_ns_ = now_ns; }

  // The first rule that does not hold, or null. Looks at what the last Bus::poll() took in.
  const HealthRule* violated(std::int64_t now_ns) const noexcept SINERIG_NONBLOCKING;

  // "axis_state is 1, must be = 8", for people. Not for the loop.
  std::string describe(const HealthRule& rule) const;

 private:
  const Bus& bus_;
  std::vector<HealthRule> rules_;
  std::vector<std::uint64_t> counts_at_begin_;
  std::int64_t begin_ns_ = 0;
};

}  // namespace sinerig::can
