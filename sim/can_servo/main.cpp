// can_servo DEVICE.toml : a simulated servo on a CAN interface, until it is killed or --for
// SECONDS.
#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <limits>
#include <memory>
#include <net/if.h>
#include <unistd.h>

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <sys/socket.h>

#include "sim/can_servo/servo.h"

namespace {

using namespace sinerig;

volatile std::sig_atomic_t stop_requested = 0;

void request_stop(int /*signal*/) {
  stop_requested = 1;
}

// What a controller tells the host when it has gone bus-off; vcan has none that could.
void report_bus_off(const std::string& interface) {
  const int fd = socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW);
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(if_nametoindex(interface.c_str()));
  can_frame frame{};
  frame.can_id = CAN_ERR_FLAG | CAN_ERR_BUSOFF;
  frame.can_dlc = CAN_ERR_DLC;
  if (bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      write(fd, &frame, sizeof frame) != static_cast<ssize_t>(sizeof frame))
    std::perror("can_servo: bus-off could not be reported");
  close(fd);
}

class Device {
 public:
  explicit Device(const sim::ServoSettings& settings)
      : settings_{settings},
        socket_{settings.interface, false},
        start_ns_{can::monotonic_ns()},
        motor_{settings.system, start_ns_},
        wire_{socket_, settings.faults, start_ns_},
        protocol_{settings.protocol == "mit"
                      ? sim::make_mit(settings, motor_, wire_, start_ns_)
                      : sim::make_odrive(settings, motor_, wire_, start_ns_)} {}

  void run(double seconds) {
    const std::int64_t end_ns = start_ns_ + std::llround(seconds * 1e9);
    std::int64_t now_ns = start_ns_;
    while (stop_requested == 0 && now_ns < end_ns) {
      // Frames first: what happened before now must reach the motor before now is sampled.
      can::Received received;
      while (true) {
        const can::ReceiveResult result = socket_.receive(received);
        if (result == can::ReceiveResult::frame)
          protocol_->receive(received.frame, received.time_ns);
        else if (result != can::ReceiveResult::error_frame)
          break;
      }
      now_ns = can::monotonic_ns();
      cause_faults(now_ns);
      protocol_->run(now_ns);
      const std::int64_t next_reply_ns = wire_.send_due(now_ns);
      const std::int64_t due_ns =
          std::min({next_reply_ns, protocol_->next_due_ns(), next_fault_ns(), end_ns});
      now_ns = can::monotonic_ns();
      if (due_ns > now_ns) socket_.wait(std::min<std::int64_t>(due_ns - now_ns, 1'000'000'000));
    }
  }

 private:
  std::int64_t when(double at_s, bool done) const {
    if (done || at_s <= 0.0) return std::numeric_limits<std::int64_t>::max();
    return start_ns_ + std::llround(at_s * 1e9);
  }

  std::int64_t next_fault_ns() const {
    const sim::ServoFaults& faults = settings_.faults;
    return std::min({when(faults.power_cycle_at_s, cycled_), when(faults.bus_off_at_s, bus_off_),
                     when(faults.error_at_s, tripped_)});
  }

  void cause_faults(std::int64_t now_ns) {
    const sim::ServoFaults& faults = settings_.faults;
    if (now_ns >= when(faults.power_cycle_at_s, cycled_)) {
      cycled_ = true;
      protocol_->power_cycle(now_ns);
    }
    if (now_ns >= when(faults.bus_off_at_s, bus_off_)) {
      bus_off_ = true;
      report_bus_off(settings_.interface);
      wire_.cut();
    }
    if (now_ns >= when(faults.error_at_s, tripped_)) {
      tripped_ = true;
      protocol_->trip(now_ns);
    }
  }

  const sim::ServoSettings& settings_;
  can::Socket socket_;
  std::int64_t start_ns_;
  sim::Motor motor_;
  sim::Wire wire_;
  std::unique_ptr<sim::Protocol> protocol_;
  bool cycled_ = false;
  bool bus_off_ = false;
  bool tripped_ = false;
};

}  // namespace

int main(int count, char** arguments) {
  const bool bounded = count == 4 && std::strcmp(arguments[2], "--for") == 0;
  if (count != 2 && !bounded) {
    std::fprintf(stderr, "usage: can_servo DEVICE.toml [--for SECONDS]\n");
    return 2;
  }
  std::signal(SIGINT, request_stop);
  std::signal(SIGTERM, request_stop);
  try {
    const auto file = config::RigFile::load(arguments[1]);
    const sim::ServoSettings settings = sim::read_servo(*file);
    Device device{settings};
    std::printf("on %s\n", settings.interface.c_str());
    std::fflush(stdout);
    device.run(bounded ? std::strtod(arguments[3], nullptr) : 1e9);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "can_servo: %s\n", error.what());
    return 1;
  }
}
