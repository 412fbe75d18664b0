// Real-time rights from the outside: what the doctor prints, and a run that is refused some of
// them. CPU 1023 is one that no machine here has.
#include <regex>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "record/sweep_reader.h"
#include "support/process.h"

namespace sinerig {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

class Doctor : public test::ProgramTest {};

TEST_F(Doctor, SaysWhatThereIsAndMeasures) {
  const auto finished = run({"doctor", "--seconds", "0.1"});
  EXPECT_EQ(finished.code, 0) << finished.err;
  EXPECT_THAT(finished.out, StartsWith("rights, started by "));
  for (const char* name :
       {"scheduling", "memory", "heap", "idle_states", "timer_slack", "kernel", "isolcpus",
        "nohz_full", "throttling", "governor", "clocksource", "timers"})
    EXPECT_THAT(finished.out, ContainsRegex("\n  " + std::string{name} + " +(ok|missing) +[^ ]"));
  EXPECT_THAT(finished.out, Not(HasSubstr("\n  cpu ")));
  EXPECT_THAT(finished.out,
              ContainsRegex("\n  p50 [0-9]+ µs, p99 [0-9]+ µs, p99.9 [0-9]+ µs, at most [0-9]+ µs\n"
                            "  100 at 1000 Hz, [0-9]+ skipped, [0-9]+ page faults?"));
}

TEST_F(Doctor, TellsScriptsWhatIsMissingAndWhatToDo) {
  write("rig.toml",
        "[loop]\nrate_hz = 500\ncpu = 1023\n[sweep]\nstart_hz = 1\nstop_hz = 9\npoints = 2\n"
        "amplitude = 1\n[limits]\n[actuator]\n[sensor.y]\n");
  const auto finished = run({"doctor", "rig.toml", "--seconds", "0.2", "--json"});
  EXPECT_EQ(finished.code, 0) << finished.err;
  const auto json = nlohmann::json::parse(finished.out);
  EXPECT_EQ(json["rights"][1]["name"], "cpu");
  EXPECT_EQ(json["rights"][1]["ok"], false);
  EXPECT_EQ(json["rights"][1]["state"], "CPU 1023 was refused: Invalid argument");
  EXPECT_THAT(json["rights"][1]["remedy"].get<std::string>(), HasSubstr("set [loop] cpu"));
  const auto& wake_ups = json["wake_ups"];
  EXPECT_EQ(wake_ups["rate_hz"], 500.0);
  EXPECT_EQ(wake_ups["count"], 100);
  int counted = 0;
  for (const auto& bin : wake_ups["histogram_us"]) counted += bin[1].get<int>();
  EXPECT_EQ(counted, 100);
  EXPECT_GE(wake_ups["p99_us"], wake_ups["p50_us"]);
}

TEST_F(Doctor, IsStrictWhenTold) {
  write("rig.toml",
        "[loop]\nrate_hz = 500\ncpu = 1023\n[sweep]\nstart_hz = 1\nstop_hz = 9\npoints = 2\n"
        "amplitude = 1\n[limits]\n[actuator]\n[sensor.y]\n");
  EXPECT_EQ(run({"doctor", "rig.toml", "--seconds", "0.1", "--strict"}).code, 1);
}

TEST_F(Doctor, RefusesWhatItCannotMeasure) {
  EXPECT_EQ(run({"doctor", "--seconds", "0"}).code, 2);
  const auto finished = run({"doctor", "nothing.toml"});
  EXPECT_EQ(finished.code, 2);
  EXPECT_THAT(finished.err, HasSubstr("nothing.toml"));
}

class RealTime : public test::ProgramTest {
 protected:
  // A second and a half of real time.
  void write_rig(const std::string& loop) const {
    write("rig.toml", "[loop]\nrate_hz = 1000\nclock = \"monotonic\"\n" + loop +
                          "[sweep]\nspacing = \"list\"\nfrequencies_hz = [50, 100]\n"
                          "amplitude = 0.5\nsettling = \"fixed\"\ntarget_db = 0\ntarget_deg = 0\n"
                          "settle_s = 0.05\nintegrate_s = 0.1\n[limits]\n[actuator]\n[sensor.y]\n"
                          "[plant]\nkind = \"transfer_function\"\nnum = [10]\nden = [1, 10]\n");
  }
};

TEST_F(RealTime, ThatIsRequiredAndNotGrantedIsRefusedBeforeAnythingMoves) {
  write_rig("cpu = 1023\nrequire_realtime = true\n");
  const auto finished = run({"run", "rig.toml"});
  EXPECT_EQ(finished.code, 2);
  EXPECT_THAT(
      finished.err,
      HasSubstr("rig.toml:5: [loop] require_realtime = true: this machine does not grant:"));
  EXPECT_THAT(finished.err,
              ContainsRegex("\n  cpu: CPU 1023 was refused: Invalid argument; set "
                            "\\[loop\\] cpu to one that this process may use: [0-9]"));
  EXPECT_FALSE(std::filesystem::exists(path("rig.sweep")));
}

TEST_F(RealTime, ThatIsNotGrantedIsWarnedOfOnceAndKeptInTheFile) {
  write_rig("cpu = 1023\n");
  const auto finished = run({"run", "rig.toml", "--no-report"});
  EXPECT_EQ(finished.code, 0) << finished.err;
  const std::string warning =
      "warning: the loop runs without real-time rights that `sinerig doctor rig.toml` says more "
      "of:";
  const std::size_t first = finished.err.find(warning);
  ASSERT_NE(first, std::string::npos) << finished.err;
  EXPECT_EQ(finished.err.find(warning, first + 1), std::string::npos);
  const auto stored = record::read_sweep(path("rig.sweep"));
  EXPECT_EQ(stored.fact("realtime_cpu"), "missing: CPU 1023 was refused: Invalid argument");
  for (const char* right : {"scheduling", "memory", "heap", "idle_states", "timer_slack"})
    EXPECT_NE(stored.fact(std::string{"realtime_"} + right), "") << right;
  ASSERT_EQ(stored.timings.size(), 2U);
  for (const auto& timing : stored.timings) EXPECT_TRUE(timing.usage);
  const std::string shown = run({"show", "rig.sweep"}).out;
  EXPECT_THAT(shown, ContainsRegex("late at most, [0-9]+ page faults?, [0-9]+ involuntary switch"));
  EXPECT_THAT(shown, HasSubstr("\nrights   without cpu"));
  const auto json = nlohmann::json::parse(run({"show", "rig.sweep", "--json"}).out);
  EXPECT_TRUE(json["timing"][0]["minor_faults"].is_number());
  EXPECT_TRUE(json["timing"][0]["involuntary_switches"].is_number());
}

TEST_F(RealTime, IsNothingToAVirtualClock) {
  write_rig("");
  write("rig.toml", std::regex_replace(read("rig.toml"), std::regex{"monotonic"}, "virtual"));
  EXPECT_EQ(run({"run", "rig.toml", "--no-report"}).code, 0);
  const auto stored = record::read_sweep(path("rig.sweep"));
  EXPECT_EQ(stored.fact("realtime_scheduling"), "");
  EXPECT_EQ(stored.usage(), std::nullopt);
  const std::string shown = run({"show", "rig.sweep"}).out;
  EXPECT_THAT(shown, HasSubstr("0.0 µs late at most\n"));
  EXPECT_THAT(shown, Not(HasSubstr("rights ")));
}

}  // namespace
}  // namespace sinerig
