// Counts the edges of a quadrature encoder: four per line of its disc, the sign from the order of
// the two signals. A leads B: up.
#pragma once

#include <cstdint>

#include "drivers/gpio/lines.h"

namespace sinerig::gpio {

class Quadrature {
 public:
  // Line 0 is A, line 1 is B.
  void start(std::uint32_t levels) noexcept { levels_ = levels & 3U; }

  // One edge: +1, −1, or 0 where the line had that level already, so that edges between were lost.
  int apply(const Edge& edge) noexcept SINERIG_NONBLOCKING {
    const std::uint32_t bit = 1U << edge.line;
    const std::uint32_t after = edge.active ? levels_ | bit : levels_ & ~bit;
    if (after == levels_) {
      ++illegal_;
      return 0;
    }
    levels_ = after;
    const bool differ = after == 1U || after == 2U;
    const int step = differ == (edge.line == 0) ? 1 : -1;
    count_ += step;
    return step;
  }

  // The first edge after some were lost. Where the line has that level already it has come back to
  // where it was, as far as anyone knows, and no second error is made of it.
  int resume(const Edge& edge) noexcept SINERIG_NONBLOCKING {
    const bool was_active = (levels_ & (1U << edge.line)) != 0;
    return was_active == edge.active ? 0 : apply(edge);
  }

  std::int64_t count() const noexcept { return count_; }
  std::uint64_t illegal() const noexcept { return illegal_; }

 private:
  std::uint32_t levels_ = 0;
  std::int64_t count_ = 0;
  std::uint64_t illegal_ = 0;
};

}  // namespace sinerig::gpio
