// Modbus TCP over this machine's loopback in real time: how late the loop is and how old what it
// sees is, at 500 Hz unless told.
//
//   bench_modbus [RATE_HZ [SECONDS]]
#include <atomic>
#include <cstdio>
#include <thread>

#include "drivers/modbus/channels.h"
#include "latency_table.h"
#include "sim/modbus_drive/server.h"

namespace {

using namespace sinerig;

modbus::Place at(std::uint16_t address) {
  return {.unit = 1,
          .table = modbus::Table::holding,
          .address = address,
          .format = {.type = modbus::RegisterType::float32}};
}

}  // namespace

int main(int count, char** arguments) {
  const double rate_hz = bench::argument(count, arguments, 1, 500.0);
  const double seconds = bench::argument(count, arguments, 2, 20.0);

  sim::DriveSettings drive;
  sim::MechanicalAxis axis;
  axis.inertia = 0.02;
  axis.damping = 0.5;
  drive.system = sim::from_mechanical_axis(axis);
  sim::DriveServer server{drive};
  std::atomic<bool> stop{false};
  std::thread device{[&] {
    realtime::enter({.priority = bench::priority_of_a_device});
    server.run(stop, 1e9, 0.01);
  }};

  modbus::LinkSettings settings;
  settings.connection.name = "drive";
  settings.connection.host = "127.0.0.1";
  const std::string address = server.address();
  settings.connection.port = std::stoi(address.substr(address.rfind(':') + 1));
  settings.period_ns = static_cast<std::int64_t>(1e9 / rate_hz);
  settings.response_timeout_ns = settings.period_ns * 3 / 4;
  settings.read_through = 8;
  settings.loop = realtime::Settings{};
  modbus::Link link{settings};
  modbus::CommandSettings command;
  command.place = at(16);
  int exit_code = 0;
  try {
    modbus::ModbusActuator actuator{link, command};
    modbus::ModbusSensor position{link, {.place = at(34)}, "position", true};
    modbus::ModbusSensor velocity{link, {.place = at(38)}, "velocity", false};
    link.open();
    actuator.start();
    actuator.arm();

    bench::LatencyTable table{rate_hz, seconds};
    table.run([&](std::uint64_t tick) { actuator.write(tick % 2 == 0 ? 0.1 : -0.1); },
              [&] {
                const Sample sample = position.read();
                velocity.read();
                return sample;
              });
    actuator.release();
    char title[128];
    std::snprintf(title, sizeof title,
                  "Modbus TCP over loopback, %g Hz, %g s: function 23, 2 registers written, 6 read",
                  rate_hz, seconds);
    table.print(title);
    const modbus::Pace pace = link.pace();
    std::printf("the driver's thread: %s\n", link.scheduling()->state.c_str());
    std::printf("an exchange takes %.1f µs (median), %.1f µs (95 %%), %.1f µs at most\n",
                1e-3 * static_cast<double>(pace.median_ns),
                1e-3 * static_cast<double>(pace.slow_ns),
                1e-3 * static_cast<double>(pace.worst_ns));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_modbus: %s\n", error.what());
    exit_code = 1;
  }
  stop.store(true);
  device.join();
  return exit_code;
}
