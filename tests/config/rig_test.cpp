// A small rig file, one line of it changed at a time, and the exact message that follows.
#include "config/rig.h"

#include <sstream>

#include <gtest/gtest.h>

#include "sim/sim_driver.h"

namespace sinerig::config {
namespace {

const std::vector<std::string> good_rig{
    "[loop]",                        // 1
    "rate_hz = 1000",                // 2
    "[sweep]",                       // 3
    "start_hz = 1",                  // 4
    "stop_hz = 100",                 // 5
    "points = 5",                    // 6
    "amplitude = 0.5",               // 7
    "[limits]",                      // 8
    "command_max = 1",               // 9
    "[actuator]",                    // 10
    "driver = \"sim\"",              // 11
    "[sensor.y]",                    // 12
    "driver = \"sim\"",              // 13
    "[plant]",                       // 14
    "kind = \"transfer_function\"",  // 15
    "num = [1]",                     // 16
    "den = [1, 10]",                 // 17
    "[output]",                      // 18
    "samples = false",               // 19
};

// The message about a rig file, everything read, checked and planned; empty when it is fine.
std::string refusal_of(const std::string& text, const std::string& name) {
  try {
    const Rig rig = read_rig(RigFile::parse(text, name));
    DeviceRequest request{.rig = rig, .actuator = &rig.actuator, .sensors = {}};
    for (const Channel& sensor : rig.sensors) request.sensors.push_back(&sensor);
    sim::sim_driver().configure(request);
    rig.file->refuse_unread();
    rig.plan();
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

std::string text_with(std::size_t line, const std::string& replacement) {
  std::ostringstream text;
  for (std::size_t i = 0; i < good_rig.size(); ++i) {
    text << (i + 1 == line ? replacement : good_rig[i]) << '\n';
  }
  return text.str();
}

TEST(ARig, HandsItsLimitsToTheGuard) {
  const Rig rig = read_rig(RigFile::parse(
      "[loop]\nrate_hz = 1000\n[sweep]\nstart_hz = 1\nstop_hz = 9\npoints = 3\namplitude = 1\n"
      "preflight = true\npreflight_gain = [0.5, 2]\n[limits]\nage_s = 0.2\nlateness_s = 0.003\n"
      "[actuator]\nunit = \"rad\"\n[sensor.y]\nunit = \"rad\"\nsoft_max = 2\nvelocity_max = 5\n"
      "soft_acceleration_max = 70\nfollowing_max = 0.1\nfollowing_s = 0.05\nallowed = [0, 8]\n"
      "age_s = 3\nhealth = true\n[sensor.z]\n[retry]\nfaults = 4\nsoft_factor = 0.25\n",
      "rig.toml"));
  const ChannelLimits& y = rig.guard.channels[0];
  EXPECT_EQ(y.soft_max, 2.0);
  EXPECT_EQ(y.velocity.hard, 5.0);
  EXPECT_EQ(y.velocity.soft, unlimited);
  EXPECT_EQ(y.acceleration.soft, 70.0);
  EXPECT_DOUBLE_EQ(y.derivative_filter_s, 0.004);
  EXPECT_EQ(y.following.hard, 0.1);
  EXPECT_EQ(y.following_ns, 50'000'000);
  EXPECT_EQ(y.allowed, (std::vector<double>{0.0, 8.0}));
  EXPECT_EQ(y.max_age_ns, 3'000'000'000);
  EXPECT_TRUE(y.watched_closely());
  EXPECT_FALSE(rig.guard.channels[1].watched_closely());
  EXPECT_EQ(rig.guard.max_age_ns, 200'000'000);
  EXPECT_EQ(rig.guard.max_lateness_ns, 3'000'000);
  EXPECT_TRUE(rig.sensors[0].health);
  EXPECT_TRUE(rig.runner.preflight.wanted);
  EXPECT_EQ(rig.runner.preflight.max_gain, 2.0);
  EXPECT_EQ(rig.runner.retry.faults, 4U);
  EXPECT_EQ(rig.runner.retry.soft_factor, 0.25);
}

TEST(ARig, IsReadCheckedAndPlanned) {
  EXPECT_EQ(refusal_of(text_with(0, ""), "rig.toml"), "");
}

TEST(ARig, IsRefusedInTheWordsOfTheManual) {
  const std::string text =
      "# a gimbal\n\n[loop]\nrate_hz = 1000\n\n[limits]\n\n[sweep]\npoints = 3\namplitude = 1\n"
      "start_hz = 1\nstop_hz = 900\n[actuator]\n[sensor.encoder]\n";
  EXPECT_EQ(refusal_of(text, "config/gimbal.toml"),
            "config/gimbal.toml:12: [sweep] stop_hz = 900: must be below half the loop rate "
            "(500 Hz)");
}

struct Change {
  const char* name;
  std::size_t line;
  const char* replacement;
  const char* message;
};

class AWrongLine : public testing::TestWithParam<Change> {};

TEST_P(AWrongLine, IsNamedWithKeyValueAndRule) {
  EXPECT_EQ(refusal_of(text_with(GetParam().line, GetParam().replacement), "rig.toml"),
            GetParam().message);
}

INSTANTIATE_TEST_SUITE_P(
    Each, AWrongLine,
    testing::Values(
        Change{"RateTooHigh", 2, "rate_hz = 2e5",
               "rig.toml:2: [loop] rate_hz = 2e+05: must be at least 0.1 and at most 100000"},
        Change{"UnitThatEndsAField", 1, "[sensor.gyro]\nunit = \"rad,s\"\n[loop]",
               "rig.toml:2: [sensor.gyro] unit = 'rad,s': must be without commas, quotes and "
               "control characters"},
        Change{"SensorCalledApplied", 1, "[sensor.applied]\n[loop]",
               "rig.toml:1: [sensor.applied] name: \"applied\" is the name of a channel that every "
               "rig has; choose another"},
        Change{"SensorWithoutAName", 1, "[sensor.\"\"]\n[loop]",
               "rig.toml:1: [sensor.] name: the sensor has no name; call it [sensor.NAME]"},
        Change{"SensorWithASlash", 1, "[sensor.\"a/b\"]\n[loop]",
               "rig.toml:1: [sensor.a/b] name: a sensor's name must be without commas, quotes, "
               "slashes and control characters"},
        Change{"RateOffItsGrid", 2, "rate_hz = 333.33333",
               "rig.toml:2: [loop] rate_hz = 333.33333: must be a whole number of millihertz"},
        Change{"RateMissing", 2, "",
               "rig.toml:1: [loop] rate_hz: is missing; it must be at least 0.1 and at most "
               "100000"},
        Change{"UnknownClock", 2, "rate_hz = 1000\nclock = \"sundial\"",
               "rig.toml:3: [loop] clock = 'sundial': must be one of \"virtual\" \"monotonic\""},
        Change{"StopAtHalfAnOddRate", 2, "rate_hz = 25",
               "rig.toml:5: [sweep] stop_hz = 100: must be below half the loop rate (12.5 Hz)"},
        Change{"StartAboveHalfTheRate", 4, "start_hz = 500",
               "rig.toml:4: [sweep] start_hz = 500: must be below half the loop rate (500 Hz)"},
        Change{"StartAtZero", 4, "start_hz = 0",
               "rig.toml:4: [sweep] start_hz = 0: must be above 0"},
        Change{"StopIsStart", 5, "stop_hz = 1",
               "rig.toml:5: [sweep] stop_hz = 1: must differ from start_hz when there is more than "
               "one point"},
        Change{"NoPoints", 6, "points = 0",
               "rig.toml:6: [sweep] points = 0: must be at least 1 and at most 100000"},
        Change{"HalfAPoint", 6, "points = 1.5",
               "rig.toml:6: [sweep] points = 1.5: must be a whole number"},
        Change{"UnknownSpacing", 6, "points = 5\nspacing = \"cubic\"",
               "rig.toml:7: [sweep] spacing = 'cubic': must be one of \"logarithmic\" \"linear\" "
               "\"list\""},
        Change{"AmplitudeAtZero", 7, "amplitude = 0",
               "rig.toml:7: [sweep] amplitude = 0: must be above 0"},
        Change{"AmplitudeMissing", 7, "",
               "rig.toml:3: [sweep] amplitude: is missing; it must be above 0"},
        Change{"AmplitudeTwice", 7, "amplitude = 0.5\namplitude_table = [[1, 0.5]]",
               "rig.toml:8: [sweep] amplitude_table = [[1, 0.5]]: stands in place of "
               "amplitude; give one of the two"},
        Change{"TableNotRising", 7, "amplitude_table = [[2, 0.5], [1, 0.5]]",
               "rig.toml:7: [sweep] amplitude_table = [[2, 0.5], [1, 0.5]]: the frequencies "
               "must rise"},
        Change{"TableRowTooLong", 7, "amplitude_table = [[1, 2, 3]]",
               "rig.toml:7: [sweep] amplitude_table = [[1, 2, 3]]: every row is "
               "[frequency_hz, amplitude]"},
        Change{"TableEmpty", 7, "amplitude_table = []",
               "rig.toml:7: [sweep] amplitude_table = []: must have a row"},
        Change{"SubBandRowTooShort", 7, "amplitude = 0.5\nsub_band_table = [[1, 5]]",
               "rig.toml:8: [sweep] sub_band_table = [[1, 5]]: each row must be [start_hz, "
               "stop_hz, points]"},
        Change{"SubBandPastHalfTheRate", 7, "amplitude = 0.5\nsub_band_table = [[1, 500, 5]]",
               "rig.toml:8: [sweep] sub_band_table = [[1, 500, 5]]: frequencies must be below half "
               "the loop rate"},
        Change{"NoSubBand", 7, "amplitude = 0.5\nsub_bands = 0",
               "rig.toml:8: [sweep] sub_bands = 0: must be at least 1 and at most 100"},
        Change{"ToleranceTooWide", 7, "amplitude = 0.5\nfrequency_tolerance = 0.2",
               "rig.toml:8: [sweep] frequency_tolerance = 0.2: must be at least 1e-09 and at most "
               "0.1"},
        Change{"SoftLimitBeyondTheHardOne", 13, "max = 1\nsoft_max = 2",
               "rig.toml:14: [sensor.y] soft_max = 2: must be below max, which stops the sweep "
               "before it"},
        Change{"SoftWindowBelowTheHardOne", 13, "min = -1\nsoft_min = -1",
               "rig.toml:14: [sensor.y] soft_min = -1: must be above min, which stops the sweep "
               "before it"},
        Change{"SoftVelocityBeyondTheHardOne", 13, "velocity_max = 1\nsoft_velocity_max = 1",
               "rig.toml:14: [sensor.y] soft_velocity_max = 1: must be below velocity_max, which "
               "stops the sweep before it"},
        Change{"AccelerationAtZero", 13, "acceleration_max = 0",
               "rig.toml:13: [sensor.y] acceleration_max = 0: must be above 0"},
        Change{"FollowingInAnotherUnit", 13, "unit = \"rad\"\nfollowing_max = 0.1",
               "rig.toml:14: [sensor.y] following_max = 0.1: needs a sensor in the unit of the "
               "command; give it the `unit` of [actuator]"},
        Change{"NoAllowedValue", 13, "allowed = []",
               "rig.toml:13: [sensor.y] allowed = []: must hold at least one value"},
        Change{"LatenessAtZero", 9, "lateness_s = 0",
               "rig.toml:9: [limits] lateness_s = 0: must be above 0"},
        Change{"PreflightAboveTheSweep", 7, "amplitude = 0.5\npreflight_level = 2",
               "rig.toml:8: [sweep] preflight_level = 2: must be above 0 and at most 1"},
        Change{"PreflightGainUpsideDown", 7, "amplitude = 0.5\npreflight_gain = [2, 1]",
               "rig.toml:8: [sweep] preflight_gain = [2, 1]: must be [smallest, largest]"},
        Change{"PreflightPhaseBeyondATurn", 7, "amplitude = 0.5\npreflight_phase_deg = [-200, 200]",
               "rig.toml:8: [sweep] preflight_phase_deg = [-200, 200]: must span a whole turn at "
               "most"},
        Change{"RetryLouder", 18, "[retry]\nsoft_factor = 1.5\n[output]",
               "rig.toml:19: [retry] soft_factor = 1.5: must be at least 0.01 and at most 1"},
        Change{"TripsInDisorder", 11, "trips_at_s = [3, 1]",
               "rig.toml:11: [actuator] trips_at_s = [3, 1]: must ascend"},
        Change{"LossWithoutAnEnd", 11, "connection_lost_s = [[3]]",
               "rig.toml:11: [actuator] connection_lost_s = [[3]]: every row is [from, to]"},
        Change{"BlockBelowACycle", 7, "amplitude = 0.5\nblock_cycles = 0.5",
               "rig.toml:8: [sweep] block_cycles = 0.5: must be at least 1"},
        Change{"AmplitudeAboveTheCommand", 7, "amplitude = 1.5",
               "rig.toml:7: [sweep] amplitude = 1.5: a command of 1.5 at 1 Hz: exceeds [limits] "
               "command_max = 1; lower the amplitude there or raise the limit"},
        Change{"AmplitudeAboveTheSlew", 9, "slew_per_s = 2.0",
               "rig.toml:7: [sweep] amplitude = 0.5: a slew of 3.14159 at 1 Hz: exceeds [limits] "
               "slew_per_s = 2; lower the amplitude there or raise the limit"},
        Change{"TooLong", 7,
               "amplitude = 0.5\nsettling = \"fixed\"\ntarget_db = 0\ntarget_deg = 0\nintegrate_s "
               "= 1e7",
               "rig.toml:11: [sweep] integrate_s = 1e+07: the dwell at 1 Hz could last "
               "1e+07 s: shorten settling or integration, or loosen frequency_tolerance"},
        Change{"LimitsCrossed", 9, "command_min = 1\ncommand_max = 0",
               "rig.toml:9: [limits] command_min = 1: must be below command_max"},
        Change{"NeutralOutside", 11, "neutral = 2",
               "rig.toml:11: [actuator] neutral = 2: must lie between [limits] command_min and "
               "command_max"},
        Change{"RampTooLong", 9, "stop_ramp_s = 61",
               "rig.toml:9: [limits] stop_ramp_s = 61: must be at least 0 and at most 60"},
        Change{"HalfAWriteFault", 9, "write_faults = 1.5",
               "rig.toml:9: [limits] write_faults = 1.5: must be a whole number"},
        Change{"NoSensor", 12, "[limits.y]",
               "rig.toml: there is no sensor; add a section [sensor.NAME]"},
        Change{"WindowCrossed", 13, "min = 1\nmax = 0",
               "rig.toml:13: [sensor.y] min = 1: must be below max"},
        Change{"VirtualClockOfHardware", 2,
               "rate_hz = 1000\nclock = \"virtual\"\n[sensor.x]\n"
               "driver = \"can\"",
               "rig.toml:3: [loop] clock = 'virtual': needs every driver to be \"sim\"; hardware "
               "runs on \"monotonic\""},
        Change{"PriorityTooHigh", 2, "rate_hz = 1000\npriority = 100",
               "rig.toml:3: [loop] priority = 100: must be at least 1 and at most 99"},
        Change{"CpuTooHigh", 2, "rate_hz = 1000\ncpu = 1024",
               "rig.toml:3: [loop] cpu = 1024: must be at least -1 and at most 1023"},
        Change{"RealTimeOfAVirtualClock", 2, "rate_hz = 1000\nrequire_realtime = true",
               "rig.toml:3: [loop] require_realtime = true: needs clock = \"monotonic\"; a virtual "
               "clock is never late"},
        Change{"NoSuchOutput", 13, "output = \"z\"",
               "rig.toml:13: [sensor.y] output = 'z': the plant has no such output; it has \"y\" "
               "\"error_code\""},
        Change{"JitterOfATick", 13, "jitter_s = 0.001",
               "rig.toml:13: [sensor.y] jitter_s = 0.001: must be at least 0 and below 0.001"},
        Change{"ClipCrossed", 13, "clip_min = 1\nclip_max = 1",
               "rig.toml:13: [sensor.y] clip_min = 1: must be below clip_max"},
        Change{"LostTooMany", 13, "lost_fraction = 2",
               "rig.toml:13: [sensor.y] lost_fraction = 2: must be at least 0 and at most 1"},
        Change{"ClampCrossed", 11, "clamp_min = 1\nclamp_max = 0",
               "rig.toml:11: [actuator] clamp_min = 1: must be below clamp_max"},
        Change{"UnknownPlant", 15, "kind = \"cloud\"",
               "rig.toml:15: [plant] kind = 'cloud': must be one of \"mechanical\" "
               "\"transfer_function\" \"zeros_poles\" \"state_space\""},
        Change{"NumeratorTooHigh", 16, "num = [1, 2, 3]",
               "rig.toml:17: [plant] den = [1, 10]: the numerator has a higher order than the "
               "denominator"},
        Change{"FrictionWithoutAVelocity", 17, "den = [1, 10]\ncoulomb_friction = 1",
               "rig.toml:18: [plant] coulomb_friction = 1: friction needs kind = \"mechanical\", "
               "which has a velocity for it to act on"},
        Change{"PlantMissing", 14, "[plnt]",
               "rig.toml:14: [plnt]: unknown section; did you mean plant?"},
        Change{"KeyOfAnotherKind", 17, "den = [1, 10]\ninertia = 2",
               "rig.toml:18: [plant] inertia: unknown key"},
        Change{"MisspeltKey", 9, "comand_max = 1",
               "rig.toml:9: [limits] comand_max: unknown key; did you mean command_max?"},
        Change{"MisspeltSection", 18, "[outptu]",
               "rig.toml:18: [outptu]: unknown section; did you mean output?"},
        Change{"SamplesNoFlag", 19, "samples = 1",
               "rig.toml:19: [output] samples = 1: must be true or false, is a number"}),
    [](const auto& instance) { return std::string{instance.param.name}; });

TEST(AList, IsReadInItsOrderAndWithinTheBand) {
  std::string text = text_with(4, "spacing = \"list\"\nfrequencies_hz = [5, 2, 9]");
  for (const char* line : {"stop_hz = 100\n", "points = 5\n"}) {
    text.erase(text.find(line), std::string{line}.size());
  }
  const Rig rig = read_rig(RigFile::parse(text, "rig.toml"));
  EXPECT_EQ(rig.sweep.frequencies_hz, (std::vector<double>{5.0, 2.0, 9.0}));
  text.replace(text.find("[5, 2, 9]"), 9, "[5, 500]");
  EXPECT_EQ(refusal_of(text, "rig.toml"),
            "rig.toml:5: [sweep] frequencies_hz = [5, 500]: every entry must be above 0 and "
            "below 500");
  text.replace(text.find("[5, 500]"), 8, "[]");
  EXPECT_EQ(refusal_of(text, "rig.toml"),
            "rig.toml:5: [sweep] frequencies_hz = []: must hold at least one");
}

TEST(TheGuard, GetsTheLimitsOfTheFile) {
  const Rig rig = read_rig(RigFile::parse(
      text_with(9,
                "command_max = 1\ncommand_min = -2\nslew_per_s = 3000\nage_s = 0.25\n"
                "write_faults = 4\nstop_ramp_s = 0.05"),
      "rig.toml"));
  EXPECT_EQ(rig.guard.command_max, 1.0);
  EXPECT_EQ(rig.guard.command_min, -2.0);
  EXPECT_EQ(rig.guard.slew_per_s, 3000.0);
  EXPECT_EQ(rig.guard.max_age_ns, 250'000'000);
  EXPECT_EQ(rig.guard.max_write_faults, 4U);
  EXPECT_EQ(rig.guard.stop_ramp_ticks, 50U);
}

TEST(TheGuard, WaitsTenTicksForASensorWhereTheRateIsLow) {
  const auto age_at = [](const char* rate) {
    std::string text = text_with(2, rate);
    text.replace(text.find("stop_hz = 100"), 13, "stop_hz = 2");
    return read_rig(RigFile::parse(text, "rig.toml")).guard.max_age_ns;
  };
  EXPECT_EQ(age_at("rate_hz = 1000"), 100'000'000);
  EXPECT_EQ(age_at("rate_hz = 10"), 1'000'000'000);
}

TEST(TheClock, IsVirtualForSimulatedRigsUnlessToldOtherwise) {
  const auto clock_of = [](const char* line) {
    return read_rig(RigFile::parse(text_with(2, line), "rig.toml")).clock;
  };
  EXPECT_EQ(clock_of("rate_hz = 1000"), ClockKind::virtual_time);
  EXPECT_EQ(clock_of("rate_hz = 1000\nclock = \"monotonic\""), ClockKind::monotonic);
  EXPECT_EQ(clock_of("rate_hz = 1000\n[sensor.x]\ndriver = \"can\""), ClockKind::monotonic);
}

}  // namespace
}  // namespace sinerig::config
