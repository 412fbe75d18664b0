// The driver behind a rig file: what it refuses, what its lines do on every way in and out, and a
// whole sweep over lines in this process.
#include <cmath>
#include <set>

#include <gmock/gmock.h>

#include "drivers/gpio/gpio_config.h"
#include "drivers/gpio/gpio_driver.h"
#include "fake_lines.h"
#include "sim/gpio_axis/axis.h"
#include "support/collecting_sink.h"
#include "support/rig_text.h"
#include "support/zero_order_hold.h"

namespace sinerig::gpio {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

struct Rig {
  explicit Rig(const std::string& text) {
    const std::string path = test::own_file("gpio-rig.toml");
    test::write_text(path, text);
    configured.emplace(path, std::vector<DriverKit>{gpio_driver(
                                 [this] { return std::make_unique<test::FakeBank>(lines); })});
  }
  test::FakeLines lines;
  std::optional<cli::ConfiguredRig> configured;
};

// Every test puts its own [limits], [actuator] and sensors into this.
std::string rig_text(const std::string& limits, const std::string& actuator,
                     const std::string& sensors = "") {
  return "[loop]\nrate_hz = 1000\n[sweep]\nspacing = \"list\"\nfrequencies_hz = [5, 10]\n"
         "amplitude = 0.1\n[limits]\n" +
         limits + "\n[actuator]\ndriver = \"gpio\"\nchip = \"c\"\n" + actuator +
         "\n[sensor.y]\ndriver = \"gpio\"\nchip = \"c\"\nline_a = 4\nline_b = 5\nscale = 0.001\n" +
         sensors;
}

const std::string small = "command_min = -1\ncommand_max = 1";
const std::string bridge = "output = \"sign_magnitude\"\nline = 0\ndirection_line = 1\n";
const std::string interlock =
    "[sensor.stop]\ndriver = \"gpio\"\nkind = \"interlock\"\nchip = \"c\"\nline = 6\n";

std::string refusal(const std::string& text) {
  try {
    const Rig rig{text};
  } catch (const config::ConfigError& refused) {
    return refused.what();
  }
  return "was accepted";
}

TEST(GpioRig, RefusesLimitsThatTheOutputCannotGive) {
  EXPECT_THAT(refusal(rig_text("command_min = -2\ncommand_max = 1", bridge)),
              HasSubstr("[actuator] full: the output gives -1 to 1: set [limits] command_min and "
                        "command_max within"));
  EXPECT_THAT(refusal(rig_text("", bridge)), HasSubstr("set [limits] command_min"));
  EXPECT_THAT(refusal(rig_text(small, "line = 0\nlow = 0\nhigh = 1")),
              HasSubstr("[actuator] high = 1: the output gives 0 to 1"));
}

TEST(GpioRig, RefusesASafeLevelThatIsNotNeutral) {
  const std::string both_ways = "line = 0\nlow = -1\nhigh = 1\n";
  EXPECT_THAT(
      refusal(rig_text(small, both_ways)),
      HasSubstr("a line left inactive is -1, not the neutral 0: choose the other level, set "
                "neutral, or give an enable_line"));
  EXPECT_EQ(refusal(rig_text(small, both_ways + "enable_line = 2")), "was accepted");
  EXPECT_THAT(refusal(rig_text(small, bridge + "neutral = 0.2")),
              HasSubstr("neutral = 0.2: must be 0"));
}

TEST(GpioRig, RefusesAMotionFasterThanTheSteps) {
  const std::string stepper = "output = \"step\"\nline = 0\ndirection_line = 1\nstep = 0.01\n";
  EXPECT_THAT(refusal(rig_text(small, stepper)),
              HasSubstr("steps_per_s: the output moves by 5 per second at most: set [limits] "
                        "velocity_max to that or less"));
  EXPECT_EQ(refusal(rig_text(small + "\nvelocity_max = 5", stepper)), "was accepted");
  EXPECT_THAT(refusal(rig_text(small + "\nvelocity_max = 5", stepper + "steps_per_s = 100")),
              HasSubstr("moves by 1 per second at most"));
  EXPECT_THAT(refusal(rig_text(small, stepper + "steps_per_s = 800")),
              HasSubstr("must be above 0 and at most 500"));
}

TEST(GpioRig, RefusesLinesThatAreNone) {
  EXPECT_THAT(
      refusal(rig_text(small, bridge + "active_low = [\"enable_line\"]")),
      HasSubstr("\"enable_line\" is no line of this channel; it has \"line\" \"direction_line\""));
  EXPECT_THAT(
      refusal(rig_text(small, "output = \"sign_magnitude\"\nline = 0.5\ndirection_line = 1")),
      HasSubstr("line = 0.5: must be a name in quotes or a whole number"));
  EXPECT_THAT(refusal(rig_text(small, "output = \"sign_magnitude\"\nline = 0")),
              HasSubstr("direction_line: is missing"));
  EXPECT_THAT(refusal(rig_text(small, bridge + "low = 0")), HasSubstr("low: unknown key"));
}

TEST(GpioRig, TakesNamesAndNumbersAndSaysWhichAreActiveLow) {
  Rig rig{rig_text(small,
                   "output = \"sign_magnitude\"\nline = \"GPIO17\"\ndirection_line = 1\n"
                   "enable_line = 2\nactive_low = [\"enable_line\"]")};
  rig.configured->open();
  const LineRequest& outputs = rig.lines.requests.back();
  EXPECT_EQ(outputs.chip, "c");
  EXPECT_EQ(outputs.lines[0].name, "GPIO17");
  EXPECT_EQ(outputs.lines[1].name, "1");
  EXPECT_TRUE(outputs.lines[2].active_low);
  EXPECT_FALSE(outputs.lines[0].active_low);
}

TEST(GpioRig, EnablesWithTheFirstCommandAndEndsSafe) {
  Rig rig{rig_text(small, bridge + "enable_line = 2")};
  rig.configured->open();
  rig.configured->arm();
  EXPECT_THAT(rig.lines.history, ElementsAre(0U)) << "nothing is driven before the first command";
  Actuator& actuator = rig.configured->actuator();
  EXPECT_EQ(actuator.write(-1.0).value, -1.0);
  EXPECT_EQ(rig.lines.driven, 0b111U);
  actuator.release();
  EXPECT_EQ(rig.lines.driven, 0b010U) << "the direction may stay, nothing is driven";
  actuator.release();
  EXPECT_EQ(rig.lines.driven, 0b010U);
}

TEST(GpioRig, EndsSafeWhenItIsDropped) {
  Rig rig{rig_text(small, bridge + "enable_line = 2")};
  rig.configured->open();
  rig.configured->actuator().write(1.0);
  EXPECT_EQ(rig.lines.driven, 0b101U);
  rig.configured.reset();
  EXPECT_EQ(rig.lines.driven, 0U);
  EXPECT_FALSE(rig.lines.outputs_held);
}

TEST(GpioRig, WritesNeutralForACommandThatIsNoNumber) {
  Rig rig{rig_text(small, bridge)};
  rig.configured->open();
  Actuator& actuator = rig.configured->actuator();
  actuator.write(1.0);
  const Sample sample = actuator.write(std::nan(""));
  EXPECT_EQ(sample.fault, Fault::range);
  EXPECT_EQ(sample.value, 0.0);
  EXPECT_EQ(rig.lines.driven, 0U);
}

TEST(GpioRig, SaysWhatTheLinesHoldWhenTheyCannotBeSet) {
  Rig rig{rig_text(small, bridge)};
  rig.configured->open();
  Actuator& actuator = rig.configured->actuator();
  EXPECT_EQ(actuator.write(1.0).value, 1.0);
  rig.lines.refuse = true;
  const Sample sample = actuator.write(0.0);
  EXPECT_EQ(sample.fault, Fault::bus);
  EXPECT_EQ(sample.value, 1.0);
  EXPECT_THAT(rig.configured->fault_reason({.cause = TripCause::actuator_fault}),
              HasSubstr("the kernel refused to set the lines"));
}

TEST(GpioRig, TellsOfLinesThatDoNotGoSafeAndTriesAgain) {
  Rig rig{rig_text(small, bridge + "enable_line = 2")};
  rig.configured->open();
  EXPECT_EQ(rig.configured->not_released(), "") << "requested at their safe levels";
  Actuator& actuator = rig.configured->actuator();
  actuator.write(1.0);
  rig.lines.refuse = true;
  actuator.release();
  EXPECT_EQ(rig.lines.driven, 0b101U);
  EXPECT_EQ(rig.configured->not_released(),
            "the kernel refused to set the lines to their safe levels, they may still drive: "
            "c, 0, 1, 2");
  rig.configured->keep_released();
  EXPECT_NE(rig.configured->not_released(), "");
  rig.lines.refuse = false;
  rig.configured->keep_released();
  EXPECT_EQ(rig.lines.driven, 0U);
  EXPECT_EQ(rig.configured->not_released(), "");
}

TEST(GpioRig, IsNotArmedWhileTheInterlockIsOpen) {
  Rig rig{rig_text(small, bridge, interlock)};
  rig.configured->open();
  try {
    rig.configured->arm();
    FAIL() << "an open interlock must not be armed";
  } catch (const std::runtime_error& refused) {
    EXPECT_THAT(refused.what(),
                HasSubstr("stop: the interlock is open (chip c, line 6 is not active)"));
  }
  rig.lines.levels = 1;
  rig.configured->arm();
}

TEST(GpioRig, MeasuresNoResponseOfAnInterlock) {
  const Rig rig{rig_text(small, bridge, interlock)};
  const Pairs& responses = rig.configured->rig().runner.responses;
  ASSERT_EQ(responses.size(), 1U);
  EXPECT_EQ(responses[0].output, 1U);
}

TEST(Guard, StopsWhenAnInterlockOpens) {
  GuardSettings settings;
  settings.channels.resize(1);
  Guard guard{settings, 1e-3};
  guard.admit(0.7, 0, 1);
  guard.observe(0, {.value = 1.0, .time_ns = 0}, 0, 0);
  EXPECT_FALSE(guard.trip().tripped());
  guard.observe(0, {.value = 0.0, .time_ns = 0, .fault = Fault::interlock}, 0, 0);
  EXPECT_EQ(guard.trip().cause, TripCause::interlock_open);
  EXPECT_EQ(guard.admit(0.7, 1, 1), 0.0) << "the next command is neutral";
  EXPECT_THAT(describe(guard.trip(), {"stop"}), HasSubstr("stop: the interlock is open"));
}

// (0.02 s² + 0.5 s + 3) x = u behind the loop's hold.
test::PartialFractions axis_in_closed_form() {
  const std::vector<long double> den{0.02L, 0.5L, 3.0L};
  return test::partial_fractions({1.0L}, den, test::roots(den));
}

struct Sweep {
  explicit Sweep(const std::string& actuator, const std::string& limits, double amplitude) {
    const std::string path = test::own_file("gpio-sweep.toml");
    test::write_text(
        path,
        "[loop]\nrate_hz = 1000\n[sweep]\nspacing = \"list\"\n"
        "frequencies_hz = [2, 5, 10, 20]\namplitude = " +
            std::to_string(amplitude) +
            "\nsettle_s = 2\nintegrate_s = 2\nsettle_cycles = 1\nintegrate_cycles = 8\n"
            "[limits]\n" +
            limits + "\n[actuator]\ndriver = \"gpio\"\nchip = \"c\"\n" + actuator +
            "\n[sensor.y]\ndriver = \"gpio\"\nchip = \"c\"\nline_a = 4\nline_b = 5\n"
            "lag_s = 0\nscale = 4e-4\n");
    const std::vector<DriverKit> drivers{
        gpio_driver([this] { return std::make_unique<test::FakeBank>(lines); })};
    rig = config::read_rig(config::RigFile::load(path));
    device = drivers[0].configure({rig, &rig.actuator, {&rig.sensors[0]}});
  }

  // The axis follows the lines at the time of each edge, on the loop's own virtual clock.
  void run(const std::function<double(std::uint32_t)>& torque_of) {
    sim::MechanicalAxis mechanics;
    mechanics.inertia = 0.02;
    mechanics.damping = 0.5;
    mechanics.stiffness = 3.0;
    sim::Axis axis{sim::from_mechanical_axis(mechanics), 0, 4e-4, 0};
    VirtualClock clock{TickGrid{1000.0}};
    const auto now_ns = [&] {
      return clock.time_ns(clock.now());
    };
    const auto catch_up = [&] {
      while (const auto crossing = axis.next(now_ns())) {
        axis.take(*crossing);
        lines.show_count(axis.count(), crossing->time_ns);
      }
    };
    lines.on_set = [&](std::uint32_t levels) {
      catch_up();
      axis.apply(torque_of(levels), now_ns());
    };
    lines.before_read = catch_up;
    device->open(clock);
    device->arm();
    const SweepPlan plan = rig.plan();
    Guard guard{rig.guard, clock.grid().period_s()};
    Sensor* const sensors[] = {&device->sensor(0)};
    SweepRunner runner{plan, rig.runner, clock, *device->actuator(), sensors, guard, sink};
    RunControl control;
    outcome = runner.run(control);
    device.reset();
    lines.on_set = [](std::uint32_t) {
    };
    lines.before_read = [] {
    };
  }

  // The worst point in units of what rounding to whole counts lets through: an error of q / √12
  // rms, of which one coherent cycle lets √(2 f / rate) to each part of the Fourier coefficient,
  // and of these √(−2 ln(0.001 / points)) hold all points in 99.9 % of cases.
  double worst_in_intervals() const {
    double worst = 0.0;
    const test::PartialFractions plant = axis_in_closed_form();
    for (const Point& point : sink.points) {
      const long double omega =
          2.0L * std::numbers::pi_v<long double> * static_cast<long double>(point.frequency_hz);
      const test::Complex exact = test::held_response(plant, omega, 1e-3L);
      const double error = static_cast<double>(std::abs(test::Complex{point.response} - exact));
      const double sigma = 4e-4 / std::sqrt(12.0) * std::sqrt(2.0 * point.frequency_hz / 1000.0) /
                           point.input_amplitude;
      const auto points = static_cast<double>(sink.points.size());
      worst = std::max(worst, error / (sigma * std::sqrt(-2.0 * std::log(0.001 / points))));
    }
    return worst;
  }

  // The worst gain in units of the interval that the point itself gives.
  double worst_in_own_intervals() const {
    double worst = 0.0;
    const test::PartialFractions plant = axis_in_closed_form();
    for (const Point& point : sink.points) {
      const long double omega =
          2.0L * std::numbers::pi_v<long double> * static_cast<long double>(point.frequency_hz);
      const auto exact = static_cast<double>(std::abs(test::held_response(plant, omega, 1e-3L)));
      const double error_db = 20.0 * std::log10(std::abs(point.response) / exact);
      worst = std::max(worst, std::abs(error_db) / point.gain_interval_db);
    }
    return worst;
  }

  test::FakeLines lines;
  config::Rig rig{.file = nullptr,
                  .actuator = {.name = "", .unit = "", .driver = "", .section = placeholder()}};
  std::unique_ptr<Device> device;
  test::CollectingSink sink;
  RunOutcome outcome;

 private:
  static config::Section placeholder() {
    static const auto file = config::RigFile::parse("[a]\n", "placeholder");
    return file->section("a");
  }
};

TEST(SweepOverLines, OfAnHBridgeGivesTheResponseOfThePlant) {
  Sweep sweep{bridge, small, 0.5};
  sweep.run([](std::uint32_t levels) {
    return (levels & 1U) == 0 ? 0.0 : (levels & 2U) != 0 ? -1.0 : 1.0;
  });
  EXPECT_FALSE(sweep.outcome.trip.tripped());
  ASSERT_EQ(sweep.sink.points.size(), 4U);
  for (const Point& point : sweep.sink.points) EXPECT_EQ(point.status, PointStatus::good);
  EXPECT_LT(sweep.worst_in_intervals(), 1.0);
  EXPECT_LT(sweep.worst_in_own_intervals(), 3.0);
  EXPECT_EQ(sweep.lines.driven & 1U, 0U);
}

TEST(SweepOverLines, OfOneLineGivesTheResponseOfThePlant) {
  Sweep sweep{"line = 0\nlow = -1\nhigh = 1\nenable_line = 2", small, 0.5};
  sweep.run([](std::uint32_t levels) {
    return (levels & 2U) == 0 ? 0.0 : (levels & 1U) != 0 ? 1.0 : -1.0;
  });
  EXPECT_FALSE(sweep.outcome.trip.tripped());
  ASSERT_EQ(sweep.sink.points.size(), 4U);
  EXPECT_LT(sweep.worst_in_intervals(), 1.0);
  EXPECT_LT(sweep.worst_in_own_intervals(), 3.0);
  EXPECT_EQ(sweep.lines.driven, 0U);
}

TEST(SweepOverLines, OfAStepperGivesTheResponseOfThePlant) {
  Sweep sweep{"output = \"step\"\nline = 0\ndirection_line = 1\nstep = 0.2",
              small + "\nvelocity_max = 100", 0.75};
  double torque = 0.0;
  bool was_high = false;
  sweep.run([&](std::uint32_t levels) {
    const bool high = (levels & 1U) != 0;
    if (high && !was_high) torque += (levels & 2U) != 0 ? -0.2 : 0.2;
    was_high = high;
    return torque;
  });
  EXPECT_FALSE(sweep.outcome.trip.tripped());
  ASSERT_EQ(sweep.sink.points.size(), 4U);
  EXPECT_LT(sweep.worst_in_intervals(), 1.0);
}

// Whatever kind of channel reads a key, config/gpio-gimbal.toml explains it.
TEST(GpioKeys, AreAllExplainedInTheShippedRig) {
  const std::string shipped = test::text_of(test::shipped("gpio-gimbal.toml"));
  std::set<std::string> known;
  const std::string level =
      "[sensor.l]\ndriver = \"gpio\"\nkind = \"level\"\nchip = \"c\"\nline = 7\n";
  for (const std::string& text :
       {rig_text(small, bridge, interlock + level),
        rig_text(small, "line = 0\nlow = -1\nhigh = 1\nenable_line = 2"),
        rig_text(small + "\nvelocity_max = 1",
                 "output = \"step\"\nline = 0\ndirection_line = 1\nstep = 0.01")}) {
    const Rig rig{text};
    for (const std::string& key : rig.configured->rig().file->known_keys())
      if (key.starts_with("actuator.") || key.starts_with("sensor.NAME.")) known.insert(key);
  }
  EXPECT_GT(known.size(), 20U);
  // Keys that every channel has are explained in gimbal.toml.
  const std::string common = test::text_of(test::shipped("gimbal.toml")) +
                             test::text_of(test::shipped("closed-loop.toml"));
  for (const std::string& key : known) {
    const std::regex entry{"(^|\n)#? ?" + key.substr(key.rfind('.') + 1) + " = "};
    EXPECT_TRUE(std::regex_search(shipped, entry) || std::regex_search(common, entry)) << key;
  }
}

}  // namespace
}  // namespace sinerig::gpio
