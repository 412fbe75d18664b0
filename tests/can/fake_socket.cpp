#include "tests/can/fake_socket.h"

#include <linux/can.h>

namespace sinerig::can {

FakeBus& FakeBus::instance() {
  static FakeBus bus;
  return bus;
}

std::int64_t monotonic_ns() noexcept {
  return FakeBus::instance().now_ns;
}

Socket::Socket(const std::string& interface, bool fd_frames) : interface_(interface) {
  FakeBus::instance().fd_frames = fd_frames;
}

Socket::~Socket() = default;

void Socket::set_filters(const std::vector<IdFilter>& /*filters*/) {}

SendResult Socket::send(const Frame& frame) noexcept {
  FakeBus& bus = FakeBus::instance();
  const SendResult result = bus.refuses ? bus.refuses(frame) : SendResult::sent;
  if (result != SendResult::sent) return result;
  bus.sent.push_back(frame);
  if (bus.device)
    for (const Frame& answer : bus.device(frame)) bus.put(answer);
  return result;
}

ReceiveResult Socket::receive(Received& received) noexcept {
  FakeBus& bus = FakeBus::instance();
  if (bus.arrived.empty()) return ReceiveResult::nothing;
  received = bus.arrived.front();
  bus.arrived.pop_front();
  return received.error_class != 0 ? ReceiveResult::error_frame : ReceiveResult::frame;
}

bool Socket::rebind() noexcept {
  return true;
}

void Socket::set_send_room(std::size_t /*frames*/) noexcept {}

void Socket::wait(std::int64_t timeout_ns) const noexcept {
  FakeBus& bus = FakeBus::instance();
  if (bus.arrived.empty()) bus.now_ns += timeout_ns;
}

}  // namespace sinerig::can
