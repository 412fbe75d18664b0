// A set-point and its answer over a real kernel's CAN stack in real time, 500 Hz unless told: a
// simulated ODrive that answers every set-point, on vcan0. tools/bench runs it inside
// tools/virtual-bench --real-time.
//
//   bench_can [RATE_HZ [SECONDS]]
#include <atomic>
#include <cstdio>
#include <exception>
#include <thread>

#include "drivers/can/can_actuator.h"
#include "drivers/can/can_sensor.h"
#include "latency_table.h"
#include "sim/can_servo/device.h"

namespace {

using namespace sinerig;

constexpr std::uint32_t command_id = 0x0E;
constexpr std::uint32_t feedback_id = 0x09;

can::Signal float32() {
  can::Signal signal;
  signal.length = 32;
  signal.encoding = can::Encoding::float32;
  return signal;
}

sim::ServoSettings servo() {
  sim::ServoSettings settings;
  settings.interface = "vcan0";
  settings.protocol = "odrive";
  settings.feedback_s = 0.0;
  settings.reply_to_command = true;
  sim::MechanicalAxis axis;
  axis.inertia = 0.02;
  axis.damping = 0.5;
  settings.system = sim::from_mechanical_axis(axis);
  return settings;
}

void measure(double rate_hz, double seconds) {
  can::Bus bus{"vcan0", false};
  can::CommandSettings command;
  command.frame.id = command_id;
  command.frame.length = 8;
  command.signal = float32();
  can::CanActuator actuator{bus, command};
  can::FeedbackSettings feedback;
  feedback.pattern.id = feedback_id;
  feedback.pattern.minimum_length = 8;
  feedback.signal = float32();
  can::CanSensor position{bus, feedback};
  bus.start();
  actuator.start();
  actuator.arm();
  bench::LatencyTable table{rate_hz, seconds};
  table.run([&](std::uint64_t tick) { actuator.write(tick % 2 == 0 ? 0.1 : -0.1); },
            [&] { return position.read(); });
  actuator.release();
  char title[96];
  std::snprintf(title, sizeof title, "vcan, %g Hz, %g s: a set-point and its answer per tick",
                rate_hz, seconds);
  table.print(title);
  const can::BusCounters& seen = bus.counters();
  std::printf("%llu frames sent, %llu dropped, %llu taken in\n",
              static_cast<unsigned long long>(seen.sent),
              static_cast<unsigned long long>(seen.dropped_full + seen.dropped_dead),
              static_cast<unsigned long long>(seen.received));
}

}  // namespace

int main(int count, char** arguments) {
  const double rate_hz = bench::argument(count, arguments, 1, 500.0);
  const double seconds = bench::argument(count, arguments, 2, 20.0);
  try {
    sim::ServoDevice device{servo()};
    std::atomic<bool> stop{false};
    std::thread drive{[&] {
      realtime::enter({.priority = bench::priority_of_a_device});
      while (!stop.load()) device.run_once(10'000'000);
    }};
    int exit_code = 0;
    try {
      measure(rate_hz, seconds);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "bench_can: %s\n", error.what());
      exit_code = 1;
    }
    stop.store(true);
    drive.join();
    return exit_code;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_can: %s\n", error.what());
    return 1;
  }
}
