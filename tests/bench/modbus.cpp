// Modbus TCP over this machine's loopback in real time: how late the loop is and how old what it
// sees is, at 500 Hz unless told.
//
//   bench_modbus [RATE_HZ [SECONDS]]
#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <thread>
#include <vector>

#include "drivers/modbus/channels.h"
#include "drivers/monotonic_time.h"
#include "sim/modbus_drive/server.h"
#include "sweep/clock.h"

namespace {

using namespace sinerig;

void print_quantiles(const char* what, std::vector<std::int64_t>& values) {
  if (values.empty()) return;
  std::ranges::sort(values);
  const auto last = static_cast<double>(values.size() - 1);
  std::printf("%-28s", what);
  for (const double part : {0.5, 0.9, 0.99, 0.999, 1.0})
    std::printf(" %9.1f",
                1e-3 * static_cast<double>(values[static_cast<std::size_t>(part * last)]));
  std::printf("\n");
}

modbus::Place at(std::uint16_t address) {
  return {.unit = 1,
          .table = modbus::Table::holding,
          .address = address,
          .format = {.type = modbus::RegisterType::float32}};
}

}  // namespace

int main(int count, char** arguments) {
  const double rate_hz = count > 1 ? std::atof(arguments[1]) : 500.0;
  const double seconds = count > 2 ? std::atof(arguments[2]) : 20.0;

  sim::DriveSettings drive;
  sim::MechanicalAxis axis;
  axis.inertia = 0.02;
  axis.damping = 0.5;
  drive.system = sim::from_mechanical_axis(axis);
  sim::DriveServer server{drive};
  std::atomic<bool> stop{false};
  std::thread device{[&] {
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

    MonotonicClock clock{TickGrid{rate_hz}};
    const auto ticks = static_cast<std::uint64_t>(rate_hz * seconds);
    std::vector<std::int64_t> lateness_ns, age_ns, tick_ns;
    for (auto* values : {&lateness_ns, &age_ns, &tick_ns}) values->reserve(ticks);
    std::uint64_t index = 0, skipped = 0, missing = 0;
    while (index < ticks) {
      const Tick tick = clock.wait();
      skipped += tick.index - index;
      index = tick.index + 1;
      const std::int64_t begin_ns = monotonic_now_ns();
      actuator.write(tick.index % 2 == 0 ? 0.1 : -0.1);
      const Sample sample = position.read();
      velocity.read();
      const std::int64_t end_ns = monotonic_now_ns();
      lateness_ns.push_back(tick.lateness.count());
      tick_ns.push_back(end_ns - begin_ns);
      if (sample.fault == Fault::none)
        age_ns.push_back(end_ns - sample.time_ns);
      else
        ++missing;
    }
    const modbus::Pace pace = link.pace();
    std::printf("Modbus TCP over loopback, %g Hz, %g s: function 23, 2 registers written, 6 read\n",
                rate_hz, seconds);
    std::printf("%-28s %9s %9s %9s %9s %9s   µs\n", "", "50 %", "90 %", "99 %", "99.9 %", "most");
    print_quantiles("loop lateness", lateness_ns);
    print_quantiles("driver's calls per tick", tick_ns);
    print_quantiles("age of a sample in the loop", age_ns);
    std::printf("an exchange takes %.1f µs (median), %.1f µs (95 %%), %.1f µs at most\n",
                1e-3 * static_cast<double>(pace.median_ns),
                1e-3 * static_cast<double>(pace.slow_ns),
                1e-3 * static_cast<double>(pace.worst_ns));
    std::printf("%llu ticks skipped, %llu without a new sample\n",
                static_cast<unsigned long long>(skipped), static_cast<unsigned long long>(missing));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_modbus: %s\n", error.what());
    exit_code = 1;
  }
  stop.store(true);
  device.join();
  return exit_code;
}
