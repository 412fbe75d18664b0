// Frame lists: what is sent one after the other to start, arm, disarm and shut down a device, with
// waits and expected answers. They run before and after the loop and may wait.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/can/bus.h"

namespace sinerig::can {

// An answer that must come after the step's frame, and one that must not (an SDO abort).
struct Expectation {
  Pattern pattern;
  std::optional<Pattern> refusal;
  std::int64_t timeout_ns = 500'000'000;
  std::size_t slot = 0;  // given by listen_for()
  std::size_t refusal_slot = 0;
};

struct Step {
  std::string name;            // for messages: "closed-loop control"
  std::optional<Frame> frame;  // none: only wait or expect
  std::optional<Expectation> expect;
  std::int64_t delay_ns = 0;  // after sending, or after the answer
  std::uint32_t repeats = 1;  // send again this often, until the answer comes
  bool neutral = false;       // sends the neutral set-point: CanActuator gives frame and company
  std::vector<Frame> company = {};  // sent right after the frame
};

using Sequence = std::vector<Step>;

// Has the bus listen for every expected answer. Before Bus::start().
void listen_for(Bus& bus, Sequence& sequence);

// Throws std::runtime_error at the first step that cannot be sent or is not answered as expected,
// StopRequested where a stop is: no further step is begun.
void run(Bus& bus, const Sequence& sequence, const std::string& list_name);

// How long several frames wait, together, for a bus that is dead to come back: longer than a
// controller with the usual restart-ms = 100 stays off.
struct Patience {
  std::int64_t left_ns = 300'000'000;
};

// For the way out: every step is tried whatever the ones before did, nothing is waited for longer
// than the step says and `patience` allows. Returns the number of steps that failed.
int run_all(Bus& bus, const Sequence& sequence, Patience& patience) noexcept;

// Sends a frame that must go out if at all possible: a full queue is tried again for up to 20 ms, a
// dead bus for as long as there is patience left.
SendResult send_surely(Bus& bus, const Frame& frame, Patience& patience) noexcept;

}  // namespace sinerig::can
