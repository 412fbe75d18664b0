// modbus_drive DEVICE.toml : a simulated Modbus drive, TCP or RTU on a pseudo-terminal, until it is
// killed or --for SECONDS. At its end it prints when it was on.
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>

#include "sim/modbus_drive/server.h"

namespace {

std::atomic<bool> stop_requested{false};

void request_stop(int /*signal*/) {
  stop_requested.store(true);
}

}  // namespace

int main(int count, char** arguments) {
  using namespace sinerig;
  const bool bounded = count == 4 && std::strcmp(arguments[2], "--for") == 0;
  if (count != 2 && !bounded) {
    std::fprintf(stderr, "usage: modbus_drive DEVICE.toml [--for SECONDS]\n");
    return 2;
  }
  std::signal(SIGINT, request_stop);
  std::signal(SIGTERM, request_stop);
  std::signal(SIGPIPE, SIG_IGN);
  try {
    const auto file = config::RigFile::load(arguments[1]);
    sim::DriveServer server{sim::read_drive(*file)};
    std::printf("on %s\n", server.address().c_str());
    std::fflush(stdout);
    server.run(stop_requested, bounded ? std::strtod(arguments[3], nullptr) : 1e9);
    std::fputs(server.account().c_str(), stdout);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "modbus_drive: %s\n", error.what());
    return 1;
  }
}
