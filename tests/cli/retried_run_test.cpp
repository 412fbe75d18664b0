// A sweep whose simulated drive trips and is lost, as a user sees it.
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "record/sweep_reader.h"
#include "support/process.h"

namespace sinerig {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

class RetriedRun : public test::ProgramTest {
 protected:
  static std::string rig(const std::string& sweep, const std::string& actuator,
                         const std::string& retry) {
    return "[loop]\nrate_hz = 500\n[sweep]\nstart_hz = 5\nstop_hz = 20\npoints = 5\n"
           "amplitude = 0.5\nsettle_s = 2\n" +
           sweep + "\n[limits]\nstop_ramp_s = 0.1\n[actuator]\n" + actuator +
           "\n[sensor.y]\nnoise_rms = 1e-4\n[sensor.drive]\noutput = \"error_code\"\n"
           "health = true\nallowed = [0]\n[retry]\n" +
           retry + "\n[plant]\nkind = \"transfer_function\"\nnum = [60]\nden = [1, 60]\n";
  }
  std::vector<std::string> events() const {
    std::vector<std::string> lines;
    for (const auto& event : record::read_sweep(path("rig.sweep")).events) {
      lines.push_back(event.kind + (event.detail.empty() ? "" : ": " + event.detail));
    }
    return lines;
  }
};

TEST_F(RetriedRun, ArmsItsDriveAgainAndMeasuresEveryPoint) {
  write("rig.toml", rig("", "trips_at_s = [3.0]\nfailing_arms = 1\nconnection_lost_s = [[12, 13]]",
                        "faults = 3\nwait_s = 0.8"));
  const auto finished = run({"run", "rig.toml", "--no-report"});
  EXPECT_EQ(finished.code, 0) << finished.err;
  const auto lines = events();
  EXPECT_THAT(lines, Contains("tripped: the actuator reports a fault (tick 1500; command changed "
                              "to " +
                              [&] {
                                const std::string tripped =
                                    *std::ranges::find_if(lines, [](const std::string& line) {
                                      return line.rfind("tripped", 0) == 0;
                                    });
                                const auto at = tripped.find("changed to ") + 11;
                                return tripped.substr(at);
                              }()));
  EXPECT_THAT(lines, Contains("device_fault: the simulated drive has tripped"));
  EXPECT_THAT(lines, Contains("rearm_failed: the simulated drive refuses to be armed: its fault is "
                              "still there"));
  EXPECT_THAT(lines, Contains("device_fault: the connection to the simulated drive is lost"));
  EXPECT_EQ(std::ranges::count(lines, "rearmed"), 2);
  const auto stored = record::read_sweep(path("rig.sweep"));
  ASSERT_EQ(stored.responses.size(), 1U);  // a health channel is none
  ASSERT_EQ(stored.responses[0].points.size(), 5U);
  for (const auto& point : stored.responses[0].points) EXPECT_EQ(point.status, "good");
}

TEST_F(RetriedRun, StopsCleanlyWhenItsTriesAreSpent) {
  write("rig.toml", rig("", "connection_lost_s = [[3, 1000]]", "faults = 3\nwait_s = 0.5"));
  const auto finished = run({"run", "rig.toml"});
  EXPECT_EQ(finished.code, 3);
  EXPECT_THAT(finished.err, HasSubstr("2 faulty writes to the actuator in a row (limit 2) (tick "
                                      "1501; command changed to "));
  EXPECT_THAT(finished.err, HasSubstr("the connection to the simulated drive is lost (3 tries to "
                                      "arm again are spent, [retry])"));
  EXPECT_THAT(finished.out, HasSubstr("rearm_failed: the simulated drive does not answer"));
  EXPECT_EQ(events().back(), "finished");
}

TEST_F(RetriedRun, KeepsTheFileItWasToReplaceWhereTheDriveDoesNotAnswer) {
  write("rig.toml", rig("", "", ""));
  ASSERT_EQ(run({"run", "rig.toml", "--no-report"}).code, 0);
  const std::string before = read("rig.sweep");
  write("rig.toml", rig("", "connection_lost_s = [[0, 1000]]", ""));
  const auto refused = run({"run", "rig.toml", "--force"});
  EXPECT_EQ(refused.code, 1);
  EXPECT_THAT(refused.err, HasSubstr("the simulated drive does not answer"));
  EXPECT_EQ(read("rig.sweep"), before);
}

TEST_F(RetriedRun, TellsOfItsPreflightAndStopsBeforeTheSweepWhereItFails) {
  write("rig.toml", rig("preflight = true\npreflight_gain = [0.5, 2]", "", ""));
  const auto passed = run({"run", "rig.toml", "--no-report"});
  EXPECT_EQ(passed.code, 0) << passed.err;
  EXPECT_THAT(passed.out, HasSubstr("preflight: passed: y/applied at 5 Hz, 0.05: gain 0.88"));
  EXPECT_THAT(passed.err, Not(HasSubstr("a wrong sign or unit passes")));
  write("rig.toml", rig("preflight = true", "", ""));
  EXPECT_THAT(run({"run", "rig.toml", "--no-report", "--force", "-o", "rig.sweep"}).err,
              HasSubstr("a wrong sign or unit passes"));

  write("rig.toml", rig("preflight = true\npreflight_phase_deg = [90, 270]", "", ""));
  const auto failed = run({"run", "rig.toml", "--no-report", "--force", "-o", "rig.sweep"});
  EXPECT_EQ(failed.code, 3);
  EXPECT_THAT(failed.err, HasSubstr("y answers the pre-flight dwell with a phase of "));
  EXPECT_THAT(failed.err,
              HasSubstr("outside [sweep] preflight_phase_deg (270°); is a sign wrong? (tick "));
  EXPECT_THAT(failed.out, HasSubstr("preflight: failed: y/applied at 5 Hz"));
}

}  // namespace
}  // namespace sinerig
