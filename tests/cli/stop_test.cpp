// From a signal to a released actuator.
#include <csignal>
#include <random>

#include <gmock/gmock.h>

#include "cli/stop_on_signal.h"
#include "record/sweep_reader.h"
#include "support/guarded_bench.h"
#include "support/parameters.h"
#include "support/process.h"

namespace sinerig {
namespace {

using test::GuardedBench;

constexpr int signals[] = {SIGINT, SIGTERM, SIGHUP};

// As in a terminal, whoever runs the tests: nohup and a script's background ignore some.
class ASignal : public testing::Test {
 protected:
  ASignal() {
    for (const int each : {SIGINT, SIGTERM, SIGHUP, SIGQUIT}) std::signal(each, SIG_DFL);
  }
};
using ASecondSignal = ASignal;

auto disposition_of(int signal) {
  struct sigaction now {};
  sigaction(signal, nullptr, &now);
  return now.sa_handler;
}

TEST_F(ASignal, ReleasesTheActuatorWithinTheRampAndTwoTicks) {
  const std::uint64_t first_seed = test::seed(1);
  for (std::uint64_t i = 0; i < test::count(1000); ++i) {
    SCOPED_TRACE(testing::Message()
                 << "SINERIG_TEST_SEED=" << first_seed + i << " SINERIG_TEST_COUNT=1");
    std::mt19937_64 random{first_seed + i};
    GuardedBench bench;
    const std::uint64_t ramp = random() % 60;
    const std::uint64_t at = random() % (bench.plan.min_samples() - 2);
    const int signal = signals[random() % 3];
    bench.settings.stop_ramp_ticks = ramp;
    std::uint64_t released_at = 0;
    bench.actuator.on_release = [&] {
      released_at = bench.clock.tick();
    };
    bench.sensor.value = [&](std::uint64_t now) {
      if (now == at) std::raise(signal);
      return GuardedBench::reading;
    };
    const cli::StopOnSignal stop_on_signal{bench.control};
    const RunOutcome outcome = bench.run();
    ASSERT_EQ(outcome.trip.cause, TripCause::stop_requested);
    ASSERT_EQ(outcome.trip.tick, at + 1);
    ASSERT_TRUE(bench.actuator.released);
    ASSERT_LE(released_at, at + ramp + 2);
  }
}

TEST_F(ASecondSignal, LeavesTheRampForNeutralAtOnce) {
  const std::uint64_t first_seed = test::seed(1);
  for (std::uint64_t i = 0; i < test::count(1000); ++i) {
    SCOPED_TRACE(testing::Message()
                 << "SINERIG_TEST_SEED=" << first_seed + i << " SINERIG_TEST_COUNT=1");
    std::mt19937_64 random{first_seed + i};
    GuardedBench bench;
    bench.settings.stop_ramp_ticks = 5000;
    const std::uint64_t first = random() % (bench.plan.min_samples() - 2);
    const std::uint64_t second = first + random() % 4000;
    std::uint64_t released_at = 0;
    bench.actuator.on_release = [&] {
      released_at = bench.clock.tick();
    };
    bench.sensor.value = [&](std::uint64_t now) {
      if (now == first) std::raise(signals[random() % 3]);
      if (now == second) std::raise(signals[random() % 3]);
      return GuardedBench::reading;
    };
    const cli::StopOnSignal stop_on_signal{bench.control};
    bench.run();
    ASSERT_EQ(bench.actuator.writes.back().command, GuardedBench::neutral);
    ASSERT_LE(released_at, second + 2);
  }
}

// Of those that follow, too: the run may be over, its file being written.
TEST_F(ASignal, StopsWhateverIsAroundTheRun) {
  RunControl night;
  const cli::StopOnSignal stops_the_night{night};
  {
    RunControl run;
    const cli::StopOnSignal stops_the_run{run};
    std::raise(SIGTERM);
    EXPECT_EQ(run.stop_requests.load(), 1);
  }
  EXPECT_EQ(night.stop_requests.load(), 1);
  RunControl next;
  const cli::StopOnSignal stops_the_next{next};
  EXPECT_EQ(next.stop_requests.load(), 1) << "as if it had come a moment later";
}

TEST_F(ASignal, OfQuittingIsTwoRequestsAtOnce) {
  RunControl run;
  const cli::StopOnSignal stops_the_run{run};
  ASSERT_NE(disposition_of(SIGQUIT), SIG_DFL);
  std::raise(SIGQUIT);
  EXPECT_EQ(run.stop_requests.load(), 2);
}

// What nohup, or a shell for its background, has seen to holds; but a service manager's does not.
TEST_F(ASignal, ThatWasIgnoredBeforeStaysIgnored) {
  for (const int each : {SIGHUP, SIGINT, SIGQUIT, SIGTERM}) {
    std::signal(each, SIG_IGN);
    RunControl night;
    RunControl run;
    {
      const cli::StopOnSignal stops_the_night{night};
      const cli::StopOnSignal stops_the_run{run};
      std::raise(each);
    }
    EXPECT_EQ(run.stop_requests.load(), each == SIGTERM ? 1 : 0) << each;
    EXPECT_EQ(night.stop_requests.load(), each == SIGTERM ? 1 : 0) << each;
    EXPECT_EQ(disposition_of(each), SIG_IGN) << each;
    std::signal(each, SIG_DFL);
  }
}

TEST_F(ASignal, NeitherEndsNorFreezesARunWithItsCommandStanding) {
  RunControl run;
  {
    const cli::StopOnSignal stops_the_run{run};
    for (const int each : {SIGPIPE, SIGXFSZ, SIGTSTP, SIGTTIN, SIGTTOU}) {
      ASSERT_EQ(disposition_of(each), SIG_IGN) << each;
      std::raise(each);
    }
  }
  EXPECT_EQ(run.stop_requests.load(), 0);
  for (const int each : {SIGXFSZ, SIGTSTP, SIGTTIN, SIGTTOU})
    EXPECT_EQ(disposition_of(each), SIG_DFL) << each;
}

class StoppedTwice : public test::ProgramTest {};

TEST_F(StoppedTwice, EndsBeforeItsRampAndExitsAsInterrupted) {
  write("rig.toml",
        "[loop]\nrate_hz = 500\nclock = \"monotonic\"\n"
        "[sweep]\nspacing = \"list\"\nfrequencies_hz = [50, 0.01]\namplitude = 0.5\n"
        "settling = \"fixed\"\nsettle_cycles = 1\nsettle_s = 0\nintegrate_cycles = 2\n"
        "integrate_s = 0\ntarget_db = 0\ntarget_deg = 0\n"
        "[limits]\nstop_ramp_s = 60\n[actuator]\n[sensor.y]\n"
        "[plant]\nkind = \"transfer_function\"\nnum = [60]\nden = [1, 60]\n");
  test::Program program{{"run", "rig.toml", "--no-report"}, folder_};
  EXPECT_THAT(program.read_line(), testing::StartsWith("   1/2 "));
  // Two of the same kind may become one on their way.
  program.send(SIGTERM);
  program.send(SIGINT);
  EXPECT_EQ(program.finish().code, 4);
  const auto stored = record::read_sweep(path("rig.sweep"));
  EXPECT_EQ(stored.fact("outcome"), "interrupted");
  ASSERT_GE(stored.events.size(), 3U);
  const auto& tripped = stored.events[stored.events.size() - 3];
  const auto& released = stored.events[stored.events.size() - 2];
  EXPECT_EQ(tripped.kind, "tripped");
  EXPECT_EQ(released.kind, "released");
  EXPECT_LT(released.tick - tripped.tick, 60U * 500U);
  EXPECT_THAT(stored.fact("finished_utc"), testing::Not(testing::IsEmpty()));
}

}  // namespace
}  // namespace sinerig
