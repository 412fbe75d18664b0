// can_servo DEVICE.toml : a simulated servo on a CAN interface, until it is killed or --for
// SECONDS.
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>

#include "sim/can_servo/device.h"

namespace {

constexpr std::int64_t patience_ns = 1'000'000'000;

volatile std::sig_atomic_t stop_requested = 0;

void request_stop(int /*signal*/) {
  stop_requested = 1;
}

}  // namespace

int main(int count, char** arguments) {
  using namespace sinerig;
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
    sim::ServoDevice device{settings};
    std::printf("on %s\n", settings.interface.c_str());
    std::fflush(stdout);
    const double seconds = bounded ? std::strtod(arguments[3], nullptr) : 1e9;
    const auto end_ns = can::monotonic_ns() + static_cast<std::int64_t>(seconds * 1e9);
    while (stop_requested == 0 && can::monotonic_ns() < end_ns) device.run_once(patience_ns);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "can_servo: %s\n", error.what());
    return 1;
  }
}
