// Socket and clock without a kernel behind them, linked in place of the real ones: frames go to a
// device that is called back and whose answers can be received at once; time passes where somebody
// waits for more.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <vector>

#include "drivers/can/socket.h"

namespace sinerig::can {

struct FakeBus {
  std::int64_t now_ns = 1'000'000'000;
  bool fd_frames = false;  // asked for
  std::vector<Frame> sent;
  std::deque<Received> arrived;
  // What the device says to a frame.
  std::function<std::vector<Frame>(const Frame&)> device;
  // Why a frame does not go out.
  std::function<SendResult(const Frame&)> refuses;

  void put(const Frame& frame) {
    arrived.push_back({.frame = frame, .time_ns = now_ns, .error_class = 0});
  }

  static FakeBus& instance();
};

}  // namespace sinerig::can
