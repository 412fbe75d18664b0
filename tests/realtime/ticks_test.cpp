// What a tick asks of the kernel in real time, for the drivers that need no bus: the sleep, and
// what the driver itself has to. Under the preset `rtsan` the real-time sanitizer watches the same
// runs.
#include <unistd.h>

#include <gmock/gmock.h>
#include <sys/syscall.h>

#include "realtime/loop_thread.h"
#include "realtime/real_run.h"
#ifdef SINERIG_HAS_MODBUS
#include <atomic>
#include <thread>

#include "drivers/modbus/channels.h"
#include "sim/modbus_drive/server.h"
#endif

namespace sinerig {
namespace {

using testing::Contains;
using testing::Gt;
using testing::Pair;
using testing::UnorderedElementsAre;

// A tick that comes too late does not sleep.
constexpr std::uint64_t least_ticks = 100;

sim::SimulatedRigSettings simulated_axis() {
  sim::SimulatedRigSettings settings;
  settings.system = sim::from_transfer_function({10.0}, {1.0, 10.0});
  settings.sensors = {{.output = 0, .imperfections = {.noise_rms = 1e-3}}};
  return settings;
}

TEST(SystemCalls, OfTheLoopAreTheSleepAndOneLookAtItselfPerDwell) {
  const auto traced = test::trace_loop([] {
    test::MarkingClock clock;
    sim::SimulatedRig rig{simulated_axis(), clock};
    return test::exit_code_of(test::run_in_real_time(clock, rig.actuator(), {&rig.sensor(0)}));
  });
  EXPECT_EQ(traced.exit_code, 0);
  if (test::loop_is_traced) {
    EXPECT_THAT(traced.calls, UnorderedElementsAre(Pair("clock_nanosleep", Gt(least_ticks)),
                                                   Pair("getrusage", 2U)));
  }
}

#ifndef SINERIG_UNDER_RTSAN
class MeddlingSensor final : public Sensor {
 public:
  explicit MeddlingSensor(void (*deed)()) : deed_{deed} {}
  Sample read() noexcept override {
    if (++reads_ == 150) deed_();
    return {.value = static_cast<double>(reads_)};
  }

 private:
  void (*deed_)();
  int reads_ = 0;
};

TEST(SystemCalls, ThatADriverMakesOnceAreFound) {
  const auto traced = test::trace_loop([] {
    test::MarkingClock clock;
    sim::SimulatedRig rig{simulated_axis(), clock};
    MeddlingSensor sensor{[] {
      syscall(SYS_getpid);
    }};
    return test::exit_code_of(test::run_in_real_time(clock, rig.actuator(), {&sensor}));
  });
  EXPECT_EQ(traced.exit_code, 0);
  EXPECT_THAT(traced.calls, Contains(Pair("getpid", 1U)));
}
#endif

// The first dwell warms up; from then on every page that a tick needs is there.
TEST(PageFaults, DoNotHappenOnceTheLoopIsWarm) {
  realtime::LoopThread thread{realtime::Settings{}};
  for (const auto& grant : thread.grants())
    if (!grant.granted && grant.right <= realtime::Right::heap)
      GTEST_SKIP() << "needs rights that are missing here: " << grant.state;
  test::MarkingClock clock;
  sim::SimulatedRig rig{simulated_axis(), clock};
  test::RealRun run;
  thread.start([&] { run = test::run_in_real_time(clock, rig.actuator(), {&rig.sensor(0)}); }, {});
  thread.join();
  ASSERT_EQ(run.timings.size(), 2U);
  ASSERT_TRUE(run.timings[1].usage);
  EXPECT_EQ(run.timings[1].usage->minor_faults, 0U);
  EXPECT_EQ(run.timings[1].usage->major_faults, 0U);
}

#ifdef SINERIG_HAS_MODBUS
modbus::Place number_at(std::uint16_t address) {
  return {.unit = 1,
          .table = modbus::Table::holding,
          .address = address,
          .format = {.type = modbus::RegisterType::float64}};
}

// A drive and a loop in one process, over loopback TCP.
int run_over_modbus() {
  sim::DriveSettings drive_settings;
  drive_settings.type = "float64";
  sim::MechanicalAxis axis;
  axis.inertia = 0.02;
  axis.damping = 0.5;
  axis.stiffness = 3.0;
  drive_settings.system = sim::from_mechanical_axis(axis);
  sim::DriveServer server{std::move(drive_settings)};
  std::atomic<bool> stop{false};
  std::thread drive{[&] {
    server.run(stop, 1e9, 0.01);
  }};
  int code = -1;
  {
    modbus::LinkSettings settings;
    settings.connection.name = "drive";
    settings.connection.host = "127.0.0.1";
    const std::string address = server.address();
    settings.connection.port = std::stoi(address.substr(address.rfind(':') + 1));
    settings.period_ns = 1'000'000'000;  // of what a trial must keep up with
    settings.response_timeout_ns = 1'000'000'000;
    settings.read_through = 8;
    modbus::Link link{settings};
    modbus::CommandSettings command;
    command.place = number_at(16);
    modbus::ModbusActuator actuator{link, command};
    modbus::ModbusSensor sensor{link, {number_at(34)}, "[sensor.position]", true};
    link.open();
    actuator.start();
    actuator.arm();
    test::MarkingClock clock;
    code = test::exit_code_of(test::run_in_real_time(clock, actuator, {&sensor}));
  }
  stop.store(true);
  drive.join();
  return code;
}

TEST(SystemCalls, OfAModbusTickAreTheSleepAndTheWakingOfItsThread) {
  const auto traced = test::trace_loop(run_over_modbus);
  EXPECT_EQ(traced.exit_code, 0);
  if (test::loop_is_traced) {
    EXPECT_THAT(traced.calls,
                UnorderedElementsAre(Pair("clock_nanosleep", Gt(least_ticks)),
                                     Pair("getrusage", 2U), Pair("write", Gt(least_ticks))));
  }
}
#endif

}  // namespace
}  // namespace sinerig
