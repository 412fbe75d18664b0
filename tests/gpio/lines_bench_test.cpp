// The lines of a real kernel, through the libgpiod of this build: run inside tools/virtual-bench,
// on the eight lines of its gpio-sim.
#include <array>
#include <csignal>
#include <cstdlib>
#include <ctime>
#include <fcntl.h>
#include <functional>
#include <sched.h>
#include <stdexcept>
#include <string>
#include <unistd.h>

#include <gmock/gmock.h>
#include <sys/wait.h>

#include "drivers/gpio/encoder.h"
#include "drivers/gpio/gpio_actuator.h"
#include "drivers/gpio/level.h"
#include "drivers/gpio/libgpiod.h"
#include "sim/gpio_axis/sim_lines.h"

namespace sinerig::gpio {
namespace {

using sim::DrivenLine;
using sim::PulledLine;
using testing::HasSubstr;
using testing::Not;

constexpr const char* chip = "gpiochip0";
const std::string& folder() {
  static const std::string found = sim::sim_chip_folder(chip);
  return found;
}

std::int64_t now_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

void sleep_ns(std::int64_t ns) {
  const timespec time{.tv_sec = ns / 1'000'000'000, .tv_nsec = ns % 1'000'000'000};
  clock_nanosleep(CLOCK_MONOTONIC, 0, &time, nullptr);
}

LineRequest lines(const std::vector<Line>& wanted) {
  return {.chip = chip, .lines = wanted};
}

template <class Action>
std::string refusal(Action action) {
  try {
    action();
  } catch (const std::runtime_error& refused) {
    return refused.what();
  }
  return "was accepted";
}

TEST(Outputs, DriveTheLinesInTheirOrderFromTheFirstMomentOn) {
  const auto bank = kernel_lines();
  DrivenLine five{folder(), 5};
  DrivenLine three{folder(), 3};
  DrivenLine one{folder(), 1};
  const auto outputs =
      bank->outputs(lines({{"5"}, {"3"}, {.name = "1", .active_low = true}}), 0b001);
  EXPECT_TRUE(five.high());
  EXPECT_FALSE(three.high());
  EXPECT_TRUE(one.high()) << "inactive is high where active is low";
  for (const std::uint32_t levels : {0b010U, 0b111U, 0b100U, 0b000U}) {
    ASSERT_TRUE(outputs->set(levels));
    EXPECT_EQ(five.high(), (levels & 1U) != 0);
    EXPECT_EQ(three.high(), (levels & 2U) != 0);
    EXPECT_EQ(one.high(), (levels & 4U) == 0);
  }
}

TEST(Outputs, AreSafeAfterTheActuatorHasGone) {
  const auto bank = kernel_lines();
  DrivenLine line{folder(), 2};
  const MonotonicClock clock{TickGrid{1000.0}};
  {
    GpioActuator actuator{bank->outputs(lines({{"2"}}), 0),
                          std::make_unique<DensityModulator>(DensitySettings{}),
                          {},
                          clock};
    EXPECT_EQ(actuator.write(1.0).value, 1.0);
    EXPECT_TRUE(line.high());
    actuator.release();
    EXPECT_FALSE(line.high());
    actuator.write(1.0);
  }
  EXPECT_FALSE(line.high());
}

TEST(Inputs, ReadLevelsInTheirOrder) {
  const auto bank = kernel_lines();
  PulledLine six{folder(), 6};
  PulledLine four{folder(), 4};
  const auto inputs = bank->inputs(lines({{"6"}, {.name = "4", .active_low = true}}));
  six.pull(true);
  four.pull(true);
  EXPECT_EQ(inputs->get(), 0b01U);
  six.pull(false);
  four.pull(false);
  EXPECT_EQ(inputs->get(), 0b10U);
}

TEST(Inputs, TakeTheBiasThatIsAskedFor) {
  const auto bank = kernel_lines();
  LineRequest request = lines({{"7"}});
  request.bias = Bias::pull_up;
  EXPECT_EQ(bank->inputs(request)->get(), 1U);
  request.bias = Bias::pull_down;
  EXPECT_EQ(bank->inputs(request)->get(), 0U);
}

TEST(Edges, ComeInOrderWithTheTimeAtWhichTheyHappened) {
  const auto bank = kernel_lines();
  PulledLine a{folder(), 4};
  PulledLine b{folder(), 5};
  a.pull(false);
  b.pull(false);
  const auto edges = bank->edges(lines({{"4"}, {.name = "5", .active_low = true}}));
  EXPECT_EQ(edges->get(), 0b10U);
  std::array<Edge, 8> seen{};
  EXPECT_EQ(edges->take(seen), 0U) << "nothing has happened, and nothing is waited for";
  std::array<std::int64_t, 4> before{};
  std::array<std::int64_t, 4> after{};
  for (std::size_t n = 0; n < 4; ++n) {
    sleep_ns(1'370'000);
    before[n] = now_ns();
    (n % 2 == 0 ? a : b).pull(n < 2);
    after[n] = now_ns();
  }
  ASSERT_EQ(edges->take(seen), 4U);
  for (std::size_t n = 0; n < 4; ++n) {
    EXPECT_EQ(seen[n].line, n % 2);
    EXPECT_EQ(seen[n].sequence, n + 1);
    EXPECT_EQ(seen[n].active, (n < 2) == (n % 2 == 0));
    EXPECT_GE(seen[n].time_ns, before[n]);
    EXPECT_LE(seen[n].time_ns, after[n]);
  }
}

TEST(Edges, BeyondTheQueueAreCountedAsLost) {
  const auto bank = kernel_lines();
  PulledLine a{folder(), 4};
  a.pull(false);
  MonotonicClock clock{TickGrid{1000.0}};
  clock.wait();
  Encoder encoder{bank->edges(lines({{"4"}, {"5"}})), {.lag_ns = 0}, clock};
  for (int n = 0; n < 2000; ++n) a.pull(n % 2 == 0);
  sleep_ns(1'000'000);
  EXPECT_EQ(encoder.read().fault, Fault::bus);
  EXPECT_EQ(encoder.lost(), 2000U - EdgeLines::queue_length);
  EXPECT_EQ(encoder.illegal(), 0U);
}

TEST(Edges, NearerTogetherThanTheKernelSeesAreIllegal) {
  const auto bank = kernel_lines();
  PulledLine a{folder(), 4};
  a.pull(false);
  MonotonicClock clock{TickGrid{1000.0}};
  clock.wait();
  Encoder encoder{bank->edges(lines({{"4"}, {"5"}})), {.lag_ns = 0}, clock};
  // Above the kernel's interrupt threads: both edges are over when the first is looked at.
  const sched_param urgent{.sched_priority = 99};
  const sched_param ordinary{.sched_priority = 0};
  ASSERT_EQ(sched_setscheduler(0, SCHED_FIFO, &urgent), 0);
  a.pull(true);
  a.pull(false);
  sched_setscheduler(0, SCHED_OTHER, &ordinary);
  sleep_ns(1'000'000);
  EXPECT_EQ(encoder.read().fault, Fault::bus);
  EXPECT_EQ(encoder.lost() + encoder.illegal(), 1U);
  EXPECT_EQ(encoder.count(), 0) << "no motion is made of it";
}

TEST(Requests, FindAChipByNamePathAndLabel) {
  const auto bank = kernel_lines();
  for (const char* name : {"gpiochip0", "/dev/gpiochip0", "gpio-sim.0-node0"}) {
    const LineRequest request{.chip = name, .lines = {{"0"}}};
    EXPECT_EQ(refusal([&] { bank->inputs(request)->get(); }), "was accepted") << name;
  }
}

TEST(Requests, OfAChipThatIsNotThereNameThoseThatAre) {
  const auto bank = kernel_lines();
  const LineRequest request{.chip = "gpiochip9", .lines = {{"0"}}};
  EXPECT_THAT(refusal([&] { bank->outputs(request, 0); }),
              HasSubstr("gpiochip9: there is no such GPIO chip; this machine has gpiochip0 "
                        "\"gpio-sim.0-node0\""));
}

TEST(Requests, OfALineThatIsNotThereSayHowManyThereAre) {
  const auto bank = kernel_lines();
  EXPECT_THAT(refusal([&] {
                bank->edges(lines({{"3"}, {"8"}}));
              }),
              HasSubstr("gpiochip0: has no line 8; it has 8, from 0 to 7"));
  EXPECT_THAT(refusal([&] { bank->edges(lines({{"GPIO17"}})); }),
              HasSubstr("has no line named \"GPIO17\""));
  EXPECT_THAT(refusal([&] {
                bank->edges(lines({{"3"}, {"3"}}));
              }),
              HasSubstr("line 3 is wanted twice"));
}

TEST(Requests, OfALineThatIsInUseSayByWhom) {
  const auto bank = kernel_lines();
  const auto holder = bank->inputs(lines({{"3"}}));
  const auto attempts = {std::function<void()>{[&] {
                           bank->outputs(lines({{"2"}, {"3"}}), 0);
                         }},
                         std::function<void()>{[&] {
                           bank->inputs(lines({{"3"}}));
                         }},
                         std::function<void()>{[&] {
                           bank->edges(lines({{"2"}, {"3"}}));
                         }}};
  for (const auto& attempt : attempts) {
    const std::string message = refusal(attempt);
    EXPECT_THAT(message, HasSubstr("busy; line 3 is used by \"sinerig\""));
    EXPECT_THAT(message, Not(HasSubstr("line 2 is used")));
  }
}

// What a kill -9 leaves is the chip's business; gpio-sim's lines go back to their pull.
TEST(Lines, AreFreeAgainAfterTheirProcessWasKilled) {
  const pid_t child = fork();
  if (child == 0) {
    const auto outputs = kernel_lines()->outputs(lines({{"2"}}), 1);
    raise(SIGKILL);
  }
  waitpid(child, nullptr, 0);
  const auto bank = kernel_lines();
  EXPECT_EQ(refusal([&] { bank->outputs(lines({{"2"}}), 0); }), "was accepted");
}

}  // namespace
}  // namespace sinerig::gpio
