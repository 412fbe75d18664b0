// What is repeated after a fault or a soft limit, how often, and how it ends.
#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "support/guarded_bench.h"

namespace sinerig {
namespace {

using test::GuardedBench;

std::vector<std::string> kinds_of(const GuardedBench& bench) {
  std::vector<std::string> kinds;
  for (const Event& event : bench.sink.records.events) kinds.emplace_back(to_string(event.kind));
  return kinds;
}

std::vector<std::string> words_of(const GuardedBench& bench) {
  std::vector<std::string> words;
  for (const Note& note : bench.sink.records.notes) {
    words.push_back(std::string{to_string(note.kind)} + ": " + note.text.data());
  }
  return words;
}

// A drive that has tripped until it is armed again, which it refuses the first `refusals` times.
class TrippingDrive final : public Rearm {
 public:
  TrippingDrive(GuardedBench& bench, std::vector<std::uint64_t> trips_at)
      : bench_{bench}, trips_at_{std::move(trips_at)} {
    bench.actuator.fault_at = [this](std::uint64_t tick) {
      const auto due = std::find(trips_at_.begin(), trips_at_.end(), tick);
      if (due != trips_at_.end()) tripped = true;
      return tripped ? Fault::device : Fault::none;
    };
  }
  std::string fault_reason(const Trip&) const override { return "axis_error is 64, must be = 0"; }
  std::string arm_again() override {
    EXPECT_TRUE(bench_.actuator.released);
    armed_at.push_back(bench_.clock.tick());
    if (stop_while_arming) bench_.control.stop_requests = 1;
    bench_.actuator.released = refusals > 0;
    if (refusals > 0) {
      --refusals;
      return "the drive does not answer";
    }
    tripped = false;
    return "";
  }

  std::string not_released() const override {
    return deaf ? "the drive has not taken neutral" : "";
  }
  void keep_released() noexcept override { released_at.push_back(bench_.clock.tick()); }

  bool tripped = false;
  bool deaf = false;
  std::vector<std::uint64_t> released_at;
  int refusals = 0;
  bool stop_while_arming = false;
  std::vector<std::uint64_t> armed_at;

 private:
  GuardedBench& bench_;
  std::vector<std::uint64_t> trips_at_;
};

TEST(AFault, IsAnsweredByDisarmingWaitingArmingAndRepeatingThePoint) {
  GuardedBench bench;
  TrippingDrive drive{bench, {80}};
  bench.runner_settings.retry = {.faults = 2, .wait_s = 0.5};
  const RunOutcome outcome = bench.run(&drive);

  EXPECT_FALSE(outcome.trip.tripped());
  EXPECT_EQ(outcome.faults, 1U);
  EXPECT_EQ(outcome.dwells_done, 1U);
  EXPECT_EQ(drive.armed_at, (std::vector<std::uint64_t>{81 + 500}));
  EXPECT_EQ(kinds_of(bench), (std::vector<std::string>{"started", "dwell_began", "actuator_fault",
                                                       "tripped", "released", "rearming", "rearmed",
                                                       "dwell_began", "released", "finished"}));
  EXPECT_EQ(words_of(bench),
            (std::vector<std::string>{"device_fault: axis_error is 64, must be = 0"}));
  ASSERT_EQ(bench.sink.records.points.size(), 1U);
  EXPECT_NE(bench.sink.records.points[0].status, PointStatus::stopped);
  // Nothing is written between the release and the arming, and then it begins at neutral.
  const auto& writes = bench.actuator.writes;
  const auto after = std::find_if(writes.begin(), writes.end(),
                                  [](const test::Write& write) { return write.tick > 81; });
  ASSERT_NE(after, writes.end());
  EXPECT_EQ(after->tick, 582U);
  EXPECT_NEAR(after->command, GuardedBench::neutral, 1e-12);
}

TEST(AFault, OfADriveThatIsNotReleasedIsNotToldAsIfItWere) {
  GuardedBench bench;
  TrippingDrive drive{bench, {80}};
  drive.deaf = true;
  drive.refusals = 1;
  bench.runner_settings.retry = {.faults = 1, .wait_s = 0.5};
  bench.run(&drive);
  const std::vector<std::string> kinds = kinds_of(bench);
  EXPECT_EQ(std::count(kinds.begin(), kinds.end(), "released"), 0);
  const std::vector<std::string> words = words_of(bench);
  EXPECT_EQ(std::count(words.begin(), words.end(), "not_released: the drive has not taken neutral"),
            2)
      << "after the fault, and at the end";
}

// A drive that could not be reached when it was to be released still follows its last set-point.
TEST(AFault, IsFollowedByTriesToReleaseForAsLongAsItIsWaited) {
  GuardedBench bench;
  TrippingDrive drive{bench, {80}};
  bench.runner_settings.retry = {.faults = 2, .wait_s = 2.0};
  bench.run(&drive);
  EXPECT_EQ(drive.released_at, (std::vector<std::uint64_t>{81, 581, 1081, 1581}));
}

TEST(AFault, IsNotFollowedByACommandWhereAStopIsRequestedWhileItIsArmedAgain) {
  for (const bool refuses : {false, true}) {
    GuardedBench bench;
    TrippingDrive drive{bench, {80}};
    drive.stop_while_arming = true;
    drive.refusals = refuses ? 1 : 0;
    bench.runner_settings.retry = {.faults = 5, .wait_s = 0.5};
    const RunOutcome outcome = bench.run(&drive);
    EXPECT_EQ(outcome.trip.cause, TripCause::stop_requested);
    EXPECT_EQ(drive.armed_at.size(), 1U);
    EXPECT_TRUE(bench.actuator.released);
    EXPECT_LE(bench.actuator.writes.back().tick, 81U);
  }
}

TEST(AFault, StopsTheSweepWhereItIsNotToBeRetried) {
  GuardedBench bench;
  TrippingDrive drive{bench, {80}};
  const RunOutcome outcome = bench.run(&drive);
  EXPECT_EQ(outcome.trip.cause, TripCause::actuator_fault);
  EXPECT_TRUE(drive.armed_at.empty());
}

TEST(AFault, StopsTheSweepWhenTheDeviceCannotBeArmedAgain) {
  GuardedBench bench;
  TrippingDrive drive{bench, {80}};
  drive.refusals = 1000;
  bench.runner_settings.retry = {.faults = 3, .wait_s = 0.01};
  const RunOutcome outcome = bench.run(&drive);
  EXPECT_EQ(outcome.trip.cause, TripCause::actuator_fault);
  EXPECT_EQ(outcome.trip.tick, 80U);
  EXPECT_EQ(drive.armed_at.size(), 3U);
  EXPECT_TRUE(bench.actuator.released);
  ASSERT_EQ(bench.sink.records.points.size(), 1U);
  EXPECT_EQ(bench.sink.records.points[0].status, PointStatus::stopped);
  const auto kinds = kinds_of(bench);
  EXPECT_EQ(std::count(kinds.begin(), kinds.end(), "tripped"), 1);
  EXPECT_EQ(std::count(kinds.begin(), kinds.end(), "rearming"), 3);
  EXPECT_EQ(words_of(bench)[1], "rearm_failed: the drive does not answer");
}

TEST(AFault, ThatComesBackIsRetriedSoOftenForADwellAndInAll) {
  for (const bool in_all : {false, true}) {
    GuardedBench bench;
    std::vector<std::uint64_t> trips;
    for (std::uint64_t tick = 0; tick < 10'000; tick += 50) trips.push_back(tick);
    TrippingDrive drive{bench, trips};
    bench.runner_settings.retry = {.faults = in_all ? 1000U : 4U, .wait_s = 0.001};
    if (in_all) bench.runner_settings.retry.faults_in_all = 7;
    const RunOutcome outcome = bench.run(&drive);
    EXPECT_EQ(outcome.trip.cause, TripCause::actuator_fault);
    EXPECT_EQ(outcome.faults, in_all ? 7U : 4U);
    EXPECT_EQ(bench.sink.records.points.size(), 1U);
  }
}

TEST(AFault, OfAConnectionOrAHealthChannelIsRetriedToo) {
  for (const bool code : {false, true}) {
    GuardedBench bench;
    TrippingDrive drive{bench, {}};
    if (code) {
      bench.settings.channels[0].allowed = {GuardedBench::reading};
      bench.sensor.value = [](std::uint64_t tick) {
        return tick == 60 ? 3.0 : GuardedBench::reading;
      };
    } else {
      bench.settings.max_age_ns = 5'000'000;
      bench.sensor.fault_at = [](std::uint64_t tick) {
        return tick >= 60 && tick < 90 ? Fault::timeout : Fault::none;
      };
    }
    bench.runner_settings.retry = {.faults = 1, .wait_s = 0.1};
    const RunOutcome outcome = bench.run(&drive);
    EXPECT_FALSE(outcome.trip.tripped());
    EXPECT_EQ(outcome.faults, 1U);
    const Event& tripped =
        *std::find_if(bench.sink.records.events.begin(), bench.sink.records.events.end(),
                      [](const Event& event) { return event.kind == EventKind::tripped; });
    EXPECT_EQ(tripped.trip.cause, code ? TripCause::channel_code : TripCause::channel_age);
    EXPECT_EQ(tripped.channel, first_sensor_channel);
  }
}

TEST(AWait, IsCutShortByAStopRequestAndByARecorderThatHasFailed) {
  for (const bool stalled : {false, true}) {
    GuardedBench bench;
    TrippingDrive drive{bench, {80}};
    bench.runner_settings.retry = {.faults = 2, .wait_s = 3600.0};
    if (stalled) {
      bench.sink.stalled_from = 200;
    } else {
      bench.actuator.on_release = [&bench] {
        bench.control.stop_requests = 1;
      };
    }
    const RunOutcome outcome = bench.run(&drive);
    EXPECT_EQ(outcome.trip.cause,
              stalled ? TripCause::recorder_stalled : TripCause::stop_requested);
    EXPECT_EQ(outcome.trip.command, GuardedBench::neutral);
    EXPECT_TRUE(drive.armed_at.empty());
    EXPECT_LT(bench.clock.tick(), 210U);
    EXPECT_TRUE(bench.actuator.released);
    EXPECT_EQ(bench.sink.records.points.at(0).status, PointStatus::stopped);
  }
}

// Follows the command at once and exceeds its soft limit above `too_much` of it.
void follow(GuardedBench& bench, double soft_max) {
  bench.sensor.value = [&bench](std::uint64_t) {
    return bench.actuator.last - GuardedBench::neutral;
  };
  bench.settings.channels[0].soft_max = soft_max;
}

TEST(ASoftLimit, IsAnsweredByTheSameDwellAtALowerAmplitude) {
  GuardedBench bench;
  follow(bench, 0.2);
  bench.settings.stop_ramp_ticks = 20;
  bench.runner_settings.retry = {.soft = 3, .soft_factor = 0.5, .soft_wait_s = 0.3};
  const RunOutcome outcome = bench.run();
  EXPECT_FALSE(outcome.trip.tripped());
  EXPECT_EQ(outcome.soft_trips, 2U);
  EXPECT_EQ(kinds_of(bench), (std::vector<std::string>{
                                 "started", "dwell_began", "limited", "retried", "dwell_began",
                                 "limited", "retried", "dwell_began", "released", "finished"}));
  EXPECT_DOUBLE_EQ(bench.sink.records.events[3].value, 0.25);
  EXPECT_DOUBLE_EQ(bench.sink.records.events[6].value, 0.125);
  const Trip& trip = bench.sink.records.events[2].trip;
  EXPECT_TRUE(trip.soft);
  EXPECT_GT(trip.value, 0.2);
  // The command goes to neutral over the ramp, stays there for the wait, begins again from there.
  const auto& writes = bench.actuator.writes;
  for (std::uint64_t k = 0; k <= 20; ++k) {
    const double from = writes[trip.tick].command - GuardedBench::neutral;
    EXPECT_NEAR(writes[trip.tick + k].command - GuardedBench::neutral,
                from * (1.0 - static_cast<double>(k) / 20.0), 1e-12);
  }
  for (std::uint64_t k = 20; k <= 320; ++k) {
    EXPECT_EQ(writes[trip.tick + k].command, GuardedBench::neutral);
  }
  EXPECT_EQ(bench.actuator.releases, 1);
  ASSERT_EQ(bench.sink.records.points.size(), 1U);
  EXPECT_EQ(bench.sink.records.points[0].status, PointStatus::good);
  EXPECT_NEAR(bench.sink.records.points[0].input_amplitude, 0.125, 1e-9);
  EXPECT_EQ(bench.sink.records.blocks.back().attempt, 2U);
}

TEST(ASoftLimit, ThatStaysLeavesThePointAndGoesOn) {
  GuardedBench bench;
  follow(bench, 0.001);
  bench.runner_settings.retry = {.soft = 3, .soft_wait_s = 0.01};
  const RunOutcome outcome = bench.run();
  EXPECT_FALSE(outcome.trip.tripped());
  EXPECT_EQ(outcome.dwells_done, 1U);
  ASSERT_EQ(bench.sink.records.points.size(), 1U);
  EXPECT_EQ(bench.sink.records.points[0].status, PointStatus::stopped);
  EXPECT_EQ(bench.sink.records.points[0].reason, PointReason::soft_limit);
  EXPECT_DOUBLE_EQ(bench.sink.records.points[0].reason_value, 0.125);
}

TEST(ASoftLimit, StopsTheSweepWhenAllTriesOfTheRunAreSpent) {
  GuardedBench bench;
  follow(bench, 0.001);
  bench.runner_settings.retry = {.soft = 10, .soft_in_all = 2, .soft_wait_s = 0.01};
  const RunOutcome outcome = bench.run();
  EXPECT_EQ(outcome.trip.cause, TripCause::channel_limit);
  EXPECT_TRUE(outcome.trip.soft);
  EXPECT_EQ(outcome.soft_trips, 2U);
  const auto kinds = kinds_of(bench);
  EXPECT_EQ(kinds[kinds.size() - 3], "tripped");
  EXPECT_TRUE(bench.actuator.released);
}

TEST(ASoftLimit, GivesWayToAHardOneDuringTheWait) {
  GuardedBench bench;
  follow(bench, 0.2);
  bench.settings.channels[0].max = 2.0;
  const auto following = bench.sensor.value;
  bench.sensor.value = [=](std::uint64_t tick) {
    return tick == 100 ? 5.0 : following(tick);
  };
  bench.runner_settings.retry = {.soft_wait_s = 3.0};
  const RunOutcome outcome = bench.run();
  EXPECT_EQ(outcome.trip.cause, TripCause::channel_limit);
  EXPECT_FALSE(outcome.trip.soft);
  EXPECT_EQ(outcome.trip.tick, 100U);
  EXPECT_TRUE(bench.actuator.released);
}

}  // namespace
}  // namespace sinerig
