// A run in real time under a wall clock that jumps, and through a suspension of the machine.
#include <cmath>
#include <cstdlib>

#include <gmock/gmock.h>

#include "record/sweep_reader.h"
#include "support/process.h"

namespace sinerig {
namespace {

using testing::HasSubstr;

class UnsteadyClock : public test::ProgramTest {
 protected:
  UnsteadyClock() {
    write("rig.toml",
          "[loop]\nrate_hz = 500\nclock = \"monotonic\"\n"
          "[sweep]\nspacing = \"list\"\nfrequencies_hz = [20, 50]\namplitude = 0.5\n"
          "settling = \"fixed\"\nsettle_cycles = 2\nsettle_s = 0\nintegrate_cycles = 4\n"
          "integrate_s = 0\ntarget_db = 0\ntarget_deg = 0\n"
          "[limits]\n[actuator]\n[sensor.y]\n"
          "[plant]\nkind = \"transfer_function\"\nnum = [60]\nden = [1, 60]\n");
  }

  test::Finished run_preloaded() {
    setenv("LD_PRELOAD", SINERIG_UNSTEADY_CLOCK, 1);
    const auto finished = run({"run", "rig.toml", "--no-report"});
    unsetenv("LD_PRELOAD");
    unsetenv("SINERIG_SUSPENDED_AT");
    return finished;
  }
};

TEST_F(UnsteadyClock, OfTheWallDoesNotMatter) {
  const auto finished = run_preloaded();
  EXPECT_EQ(finished.code, 0) << finished.err;
  const auto stored = record::read_sweep(path("rig.sweep"));
  EXPECT_EQ(stored.fact("outcome"), "done");
  EXPECT_NE(stored.fact("started_utc").substr(0, 13), stored.fact("finished_utc").substr(0, 13))
      << "the clock did not jump";
  for (const auto& point : stored.responses.at(0).points) {
    EXPECT_NEAR(std::abs(point.response), 60.0 / std::hypot(60.0, 6.2832 * point.frequency_hz),
                0.05);
  }
}

TEST_F(UnsteadyClock, ThatSleptStopsTheSweepAtNeutral) {
  setenv("SINERIG_SUSPENDED_AT", "60", 1);
  const auto finished = run_preloaded();
  EXPECT_EQ(finished.code, 3);
  EXPECT_THAT(finished.err, HasSubstr("the loop stood still for 3.6e+03 s (at most 1 s)"));
  const auto stored = record::read_sweep(path("rig.sweep"));
  EXPECT_EQ(stored.fact("outcome"), "stopped");
  EXPECT_EQ(stored.events.back().kind, "finished");
}

}  // namespace
}  // namespace sinerig
