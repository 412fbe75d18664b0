// A non-blocking SocketCAN raw socket on one interface.
//
// open() and set_filters() throw before the loop; the rest is for the loop's thread, never waits,
// allocates or throws. Every received frame carries a stamp in CLOCK_MONOTONIC: the adapter's where
// it has one, else the kernel's.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "drivers/can/frame.h"
#include "drivers/can/time_stamps.h"
#include "sweep/nonblocking.h"

struct can_filter;

namespace sinerig::can {

enum class SendResult : std::uint8_t {
  sent,
  queue_full,  // ENOBUFS or EAGAIN: dropped, not to be sent again later
  link_down,   // the interface is there but down
  gone,        // the interface is not there any more (adapter unplugged)
  failed,
};

enum class ReceiveResult : std::uint8_t { frame, error_frame, nothing, link_down, gone };

struct Received {
  Frame frame;
  std::int64_t time_ns = 0;       // CLOCK_MONOTONIC
  std::uint32_t error_class = 0;  // of an error frame: CAN_ERR_… of <linux/can/error.h>
};

struct IdFilter {
  std::uint32_t id = 0;
  std::uint32_t mask = 0;
  bool extended = false;
};

class Socket {
 public:
  // `fd_frames` asks for CAN-FD. Throws std::system_error: what cannot be had, why, what to do.
  Socket(const std::string& interface, bool fd_frames);
  ~Socket();
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;

  // Only frames that pass one of the filters are delivered from now on (error frames always are).
  void set_filters(const std::vector<IdFilter>& filters);

  SendResult send(const Frame& frame) noexcept SINERIG_NONBLOCKING;
  ReceiveResult receive(Received& received) noexcept SINERIG_NONBLOCKING;

  // After `gone`: binds to the interface of the same name if there is one again, with the same
  // filters (the kernel forgets them together with the interface).
  bool rebind() noexcept;

  // Lets about so many frames of this socket wait for the wire, at least the kernel's least (4 to
  // 11): one more is SendResult::queue_full. Not for the loop.
  void set_send_room(std::size_t frames) noexcept;

  // Waits until a frame can be received or the time is up. Not for the loop.
  void wait(std::int64_t timeout_ns) const noexcept;

  const std::string& interface() const noexcept { return interface_; }
  std::uint32_t overflows() const noexcept { return overflows_; }  // frames the kernel had to drop
  bool has_adapter_stamps() const noexcept { return adapter_stamps_; }

 private:
  bool apply_filters() const noexcept;

  std::string interface_;
  int fd_ = -1;
  std::vector<can_filter> filters_;
  std::uint32_t overflows_ = 0;
  bool adapter_stamps_ = false;
  ArrivalTimes arrival_times_;
};

}  // namespace sinerig::can
