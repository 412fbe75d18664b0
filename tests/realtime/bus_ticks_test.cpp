// What a tick asks of the kernel with the CAN and the GPIO driver on real kernel interfaces: run
// inside tools/virtual-bench. Its kernel has no fast path to the time, so that reading it counts.
#include <atomic>
#include <thread>

#include <gmock/gmock.h>

#include "drivers/can/can_actuator.h"
#include "drivers/can/can_sensor.h"
#include "realtime/real_run.h"
#ifdef SINERIG_GPIO
#include "drivers/gpio/encoder.h"
#include "drivers/gpio/gpio_actuator.h"
#include "drivers/gpio/libgpiod.h"
#endif

namespace sinerig {
namespace {

using testing::Gt;
using testing::Pair;
using testing::UnorderedElementsAre;

constexpr std::uint64_t least_ticks = 200;

can::Signal float_signal() {
  can::Signal signal;
  signal.length = 32;
  signal.encoding = can::Encoding::float32;
  return signal;
}

constexpr std::uint32_t command_id = 0x0E;
constexpr std::uint32_t feedback_id = 0x09;

// Says back what it was told, as a drive does.
void answer_until(const std::atomic<bool>& done, can::Socket& socket) {
  while (!done.load()) {
    socket.wait(10'000'000);
    can::Received next;
    while (socket.receive(next) == can::ReceiveResult::frame) {
      if (next.frame.id != command_id) continue;
      next.frame.id = feedback_id;
      socket.send(next.frame);
    }
  }
}

int run_over_can() {
  can::Socket peer{"vcan0", false};
  std::atomic<bool> done{false};
  std::thread drive{[&] {
    answer_until(done, peer);
  }};
  int code = -1;
  {
    can::Bus bus{"vcan0", false};
    can::CommandSettings command;
    command.frame.id = command_id;
    command.frame.length = 8;
    command.signal = float_signal();
    command.keep_alive = {{.frame = {.id = 0x700}, .period_ns = 10'000'000}};
    can::CanActuator actuator{bus, command};
    can::FeedbackSettings feedback;
    feedback.pattern.id = feedback_id;
    feedback.pattern.minimum_length = 8;
    feedback.signal = float_signal();
    can::CanSensor sensor{bus, feedback};
    bus.start();
    actuator.start();
    actuator.arm();
    test::MarkingClock clock;
    code = test::exit_code_of(test::run_in_real_time(clock, actuator, {&sensor}));
  }
  done.store(true);
  drive.join();
  return code;
}

TEST(BusTicks, OfTheCanDriverSleepSendAndReceiveAndNothingElse) {
  const auto traced = test::trace_loop(run_over_can);
  EXPECT_EQ(traced.exit_code, 0);
  if (test::loop_is_traced) {
    EXPECT_THAT(
        traced.calls,
        UnorderedElementsAre(Pair("clock_nanosleep", Gt(least_ticks)), Pair("getrusage", 2U),
                             Pair("clock_gettime", Gt(least_ticks)),
                             Pair("sendto", Gt(least_ticks)), Pair("recvmsg", Gt(least_ticks))));
  }
}

#ifdef SINERIG_GPIO
int run_over_gpio() {
  const auto bank = gpio::kernel_lines();
  test::MarkingClock clock;
  gpio::Encoder encoder{bank->edges({.chip = "gpiochip0", .lines = {{"4"}, {"5"}}}), {}, clock};
  gpio::GpioActuator actuator{bank->outputs({.chip = "gpiochip0", .lines = {{"0"}}}, 0),
                              std::make_unique<gpio::DensityModulator>(gpio::DensitySettings{}),
                              {},
                              clock};
  return test::exit_code_of(test::run_in_real_time(clock, actuator, {&encoder}));
}

TEST(BusTicks, OfTheGpioDriverSleepSetAndReadAndNothingElse) {
  const auto traced = test::trace_loop(run_over_gpio);
  EXPECT_EQ(traced.exit_code, 0);
  if (test::loop_is_traced) {
    EXPECT_THAT(traced.calls, UnorderedElementsAre(
                                  Pair("clock_nanosleep", Gt(least_ticks)), Pair("getrusage", 2U),
                                  Pair("clock_gettime", Gt(least_ticks)),
                                  Pair("ioctl", Gt(least_ticks)), Pair("read", Gt(least_ticks))));
  }
}
#endif

}  // namespace
}  // namespace sinerig
