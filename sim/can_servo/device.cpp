#include "sim/can_servo/device.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <net/if.h>
#include <unistd.h>
#include <utility>

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <sys/socket.h>

namespace sinerig::sim {
namespace {

// What a controller tells its host of the bus; vcan has none that could.
void report(const std::string& interface, std::uint32_t error_class) {
  const int fd = socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW);
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(if_nametoindex(interface.c_str()));
  can_frame frame{};
  frame.can_id = CAN_ERR_FLAG | error_class;
  frame.can_dlc = CAN_ERR_DLC;
  if (bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      write(fd, &frame, sizeof frame) != static_cast<ssize_t>(sizeof frame))
    std::perror("can_servo: the state of the bus could not be reported");
  close(fd);
}

}  // namespace

ServoDevice::ServoDevice(ServoSettings settings)
    : settings_{std::move(settings)},
      socket_{settings_.interface, false},
      start_ns_{can::monotonic_ns()},
      motor_{settings_.system, start_ns_},
      wire_{socket_, settings_.faults, start_ns_},
      protocol_{settings_.protocol == "mit" ? make_mit(settings_, motor_, wire_, start_ns_)
                                            : make_odrive(settings_, motor_, wire_, start_ns_)} {}

void ServoDevice::run_once(std::int64_t patience_ns) {
  // Frames first: what happened before now must reach the motor before now is sampled.
  can::Received received;
  while (true) {
    const can::ReceiveResult result = socket_.receive(received);
    if (result == can::ReceiveResult::frame)
      protocol_->receive(received.frame, received.time_ns);
    else if (result != can::ReceiveResult::error_frame)
      break;
  }
  const std::int64_t now_ns = can::monotonic_ns();
  cause_faults(now_ns);
  protocol_->run(now_ns);
  const std::int64_t next_reply_ns = wire_.send_due(now_ns);
  const std::int64_t due_ns =
      std::min({next_reply_ns, protocol_->next_due_ns(), next_fault_ns(), now_ns + patience_ns});
  const std::int64_t left_ns = due_ns - can::monotonic_ns();
  if (left_ns > 0) socket_.wait(left_ns);
}

std::int64_t ServoDevice::when(double at_s, bool done) const {
  if (done || at_s <= 0.0) return std::numeric_limits<std::int64_t>::max();
  return start_ns_ + std::llround(at_s * 1e9);
}

double ServoDevice::restarted_at_s() const {
  const ServoFaults& faults = settings_.faults;
  return faults.bus_off_for_s > 0.0 ? faults.bus_off_at_s + faults.bus_off_for_s : 0.0;
}

std::int64_t ServoDevice::next_fault_ns() const {
  const ServoFaults& faults = settings_.faults;
  return std::min({when(faults.power_cycle_at_s, cycled_), when(faults.bus_off_at_s, bus_off_),
                   when(restarted_at_s(), restarted_), when(faults.error_at_s, tripped_)});
}

void ServoDevice::cause_faults(std::int64_t now_ns) {
  const ServoFaults& faults = settings_.faults;
  if (now_ns >= when(faults.power_cycle_at_s, cycled_)) {
    cycled_ = true;
    protocol_->power_cycle(now_ns);
  }
  if (now_ns >= when(faults.bus_off_at_s, bus_off_)) {
    bus_off_ = true;
    report(settings_.interface, CAN_ERR_BUSOFF);
    wire_.cut(true);
  }
  if (now_ns >= when(restarted_at_s(), restarted_)) {
    restarted_ = true;
    report(settings_.interface, CAN_ERR_RESTARTED);
    wire_.cut(false);
  }
  if (now_ns >= when(faults.error_at_s, tripped_)) {
    tripped_ = true;
    protocol_->trip(now_ns);
  }
}

}  // namespace sinerig::sim
