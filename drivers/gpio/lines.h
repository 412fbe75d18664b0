// GPIO lines as the driver sees them. Behind this face stands libgpiod, 1.6 or 2.x as the build
// found it, and in tests a bank of lines in the same process.
//
// Levels are logical: "active" is what a line with active_low has when its voltage is low.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "sweep/nonblocking.h"

namespace sinerig::gpio {

enum class Bias : std::uint8_t { as_is, disabled, pull_up, pull_down };

struct Line {
  std::string name;  // its offset on the chip in digits, or the name that the chip gives it
  bool active_low = false;
};

// Lines of one chip. Bit n of a set of levels is line n of `lines`; at most 32.
struct LineRequest {
  std::string chip;  // "gpiochip0", "/dev/gpiochip0" or the chip's label
  std::vector<Line> lines;
  Bias bias = Bias::as_is;  // of inputs
};

// Lines that are driven. Destroying it gives them back: what they do then is up to the chip.
class OutputLines {
 public:
  virtual ~OutputLines() = default;

  // All lines at once. False: the kernel refused.
  virtual bool set(std::uint32_t levels) noexcept SINERIG_NONBLOCKING = 0;
};

class InputLines {
 public:
  virtual ~InputLines() = default;

  // The levels now; nothing where the kernel refused.
  virtual std::optional<std::uint32_t> get() noexcept SINERIG_NONBLOCKING = 0;
};

struct Edge {
  std::int64_t time_ns = 0;    // CLOCK_MONOTONIC, stamped in the interrupt
  std::uint32_t sequence = 0;  // from 1 over all lines of the request; what is missing was lost
  std::uint8_t line = 0;       // index in the request
  bool active = false;         // the level after the edge
};

// Lines whose every edge is queued by the kernel, `queue_length` of them before the oldest is lost.
class EdgeLines : public InputLines {
 public:
  static constexpr std::uint32_t queue_length = 1024;  // the most that kernels give to two lines

  // Moves what has come, oldest first, into `edges` and says how many; nothing: the lines are gone.
  virtual std::optional<std::size_t> take(std::span<Edge> edges) noexcept SINERIG_NONBLOCKING = 0;
};

class LineBank {
 public:
  virtual ~LineBank() = default;

  // All throw std::runtime_error with the chip, the lines, the reason and what to do. Outputs have
  // the levels `initial` from the first moment on.
  virtual std::unique_ptr<OutputLines> outputs(const LineRequest& request,
                                               std::uint32_t initial) = 0;
  virtual std::unique_ptr<InputLines> inputs(const LineRequest& request) = 0;
  virtual std::unique_ptr<EdgeLines> edges(const LineRequest& request) = 0;
};

}  // namespace sinerig::gpio
