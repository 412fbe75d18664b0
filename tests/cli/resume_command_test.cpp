// `sinerig resume`, as a user meets it.
#include <filesystem>

#include <gmock/gmock.h>

#include "cli/recorded_run.h"
#include "drivers/can/can_driver.h"
#include "record/database.h"
#include "record/sweep_reader.h"
#include "support/process.h"
#include "support/rig_text.h"

namespace sinerig {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

constexpr const char* rig_text =
    "[loop]\nrate_hz = 500\nCLOCK\n"
    "[sweep]\nspacing = \"list\"\nfrequencies_hz = [50, 20, 10]\namplitude = 0.5\n"
    "settling = \"fixed\"\nsettle_cycles = 1\nsettle_s = 0\nintegrate_cycles = CYCLES\n"
    "integrate_s = 0\ntarget_db = 0\ntarget_deg = 0\n"
    "[limits]\n[actuator]\n[sensor.y]\n"
    "[plant]\nkind = \"transfer_function\"\nnum = [60]\nden = [1, 60]\n[output]\nmax_lag_s = "
    "0.05\n";

std::string rig(const std::string& clock, const std::string& cycles) {
  std::string text = rig_text;
  text.replace(text.find("CLOCK"), 5, clock);
  return text.replace(text.find("CYCLES"), 6, cycles);
}

class Resume : public test::ProgramTest {
 protected:
  // Runs on a disk that fails as ordered.
  test::Finished faulty(const std::string& orders, const std::string& arguments) const {
    const std::string command = "cd '" + folder_.string() + "' && SINERIG_FAULTY_DISK='" + orders +
                                "' '" + FAULTY_SINERIG + "' " + arguments +
                                " >faulty.out 2>faulty.err </dev/null";
    const int status = std::system(command.c_str());
    return {.code = WEXITSTATUS(status), .out = read("faulty.out"), .err = read("faulty.err")};
  }
  // Three dwells in virtual time, killed at its n-th operation on the disk.
  void killed_at(int operation) const {
    write("rig.toml", rig("", "4"));
    faulty("kill=" + std::to_string(operation), "run rig.toml -o run.sweep --quiet");
  }
};

TEST_F(Resume, CompletesARunThatWasStoppedByASignal) {
  write("rig.toml", rig("clock = \"monotonic\"", "10"));
  {
    test::Program program{{"run", "rig.toml"}, folder_};
    EXPECT_THAT(program.read_line(), StartsWith("   1/3 "));
    program.send(SIGINT);
    EXPECT_EQ(program.finish().code, 4);
  }
  const auto first = record::read_sweep(path("rig.sweep"));
  const auto resumed = run({"resume", "rig.sweep"});
  EXPECT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_THAT(resumed.err, HasSubstr("rig.sweep: 1 of 3 dwells are finished, 2 to go"));
  EXPECT_THAT(resumed.out, StartsWith("   2/3 "));
  EXPECT_THAT(resumed.out, HasSubstr("from dwell 1: interrupted, stop requested"));
  EXPECT_THAT(resumed.out, HasSubstr("from dwell 2: done"));
  EXPECT_THAT(resumed.out, HasSubstr("disk     every point was on the disk "));
  const auto stored = record::read_sweep(path("rig.sweep"));
  EXPECT_EQ(stored.fact("outcome"), "done");
  EXPECT_EQ(stored.fact("started_utc"), first.fact("started_utc"));
  ASSERT_EQ(stored.responses.at(0).points.size(), 3U);
  EXPECT_EQ(stored.responses[0].points.back().samples, first.responses.at(0).points.back().samples);
  // A busy machine may spoil a point in real time; none is still the stopped one.
  for (const auto& point : stored.responses[0].points) EXPECT_NE(point.status, "stopped");
  EXPECT_TRUE(fs::exists(path("rig.html")));
  EXPECT_THAT(read("rig.html"), HasSubstr("interrupted and resumed"));
}

TEST_F(Resume, SaysWhenThereIsNothingToDo) {
  write("rig.toml", rig("", "4"));
  ASSERT_EQ(run({"run", "rig.toml"}).code, 0);
  const auto resumed = run({"resume", "rig.sweep"});
  EXPECT_EQ(resumed.code, 0);
  EXPECT_THAT(resumed.err, HasSubstr("rig.sweep: its run is done, there is nothing to resume"));
  EXPECT_EQ(record::read_sweep(path("rig.sweep")).parts.size(), 1U);
}

TEST_F(Resume, RefusesWhatIsNoUnfinishedRun) {
  const auto missing = run({"resume", "none.sweep"});
  EXPECT_EQ(missing.code, 1);
  EXPECT_THAT(missing.err, HasSubstr("none.sweep: does not exist"));
  write("text.sweep", std::string(2000, 'x'));
  EXPECT_EQ(run({"resume", "text.sweep"}).code, 1);
  write("empty.sweep", "");
  EXPECT_THAT(run({"resume", "empty.sweep"}).err,
              HasSubstr("empty.sweep: is not a sweep file, or one whose run was killed before it "
                        "began: there is nothing to resume"));
}

TEST_F(Resume, RefusesAFileInUseAndRunNamesItself) {
  write("rig.toml", rig("clock = \"monotonic\"", "100"));
  test::Program program{{"run", "rig.toml", "--json"}, folder_};
  program.read_line();
  program.read_line();  // a point: it runs
  const auto resumed = run({"resume", "rig.sweep"});
  EXPECT_EQ(resumed.code, 2);
  EXPECT_THAT(resumed.err, HasSubstr("rig.sweep: is being written by a sinerig that still runs; "
                                     "wait for it, or stop it with Ctrl-C"));
  EXPECT_EQ(run({"run", "rig.toml", "-o", "rig.sweep", "--force"}).code, 2);
  program.send(SIGKILL);
  program.finish();
  const auto again = run({"run", "rig.toml", "-o", "rig.sweep"});
  EXPECT_EQ(again.code, 2);
  EXPECT_THAT(again.err, HasSubstr("`sinerig resume rig.sweep` goes on with it"));
}

TEST_F(Resume, GoesOnWithTheRigFileAsItWas) {
  killed_at(60);
  write("rig.toml", rig("", "9"));
  fs::create_directories(path("elsewhere"));
  const auto resumed =
      test::Program{{"resume", "../run.sweep"}, fs::path{path("elsewhere")}}.finish();
  EXPECT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_THAT(resumed.err,
              HasSubstr("rig.toml has changed since the run began; the run goes on with the rig "
                        "file as it was"));
  EXPECT_EQ(record::read_sweep(path("run.sweep")).fact("rig_text"), rig("", "4"));
}

// What the rig file leads to is looked at before anything is opened: there is no bus here.
TEST_F(Resume, RefusesAProfileOrDbcThatHasChanged) {
  fs::copy(test::shipped("can-gimbal.toml"), folder_);
  fs::copy(test::shipped("devices"), folder_ / "devices");
  fs::create_directories(folder_ / "out");
  const auto begin = [&](const std::string& name) {
    const cli::ConfiguredRig rig{path("can-gimbal.toml"), {can::can_driver()}};
    const SweepPlan plan = rig.rig().plan();
    record::SweepWriter writer{path(name), cli::run_info(rig.rig(), plan),
                               record::SweepWriter::IfExists::refuse};
    writer.begin_part({});
    writer.commit();
  };
  begin("can-gimbal.sweep");
  begin("out/can-gimbal-1.sweep");
  write("night.toml", "[night]\nfolder = \"out\"\n[[night.sweep]]\nrig = \"can-gimbal.toml\"\n");
  EXPECT_THAT(run({"resume", "can-gimbal.sweep"}).err, Not(HasSubstr("has changed")));

  const std::string dbc = "devices/odrive-cansimple.dbc";
  write(dbc, read(dbc) + "\nCM_ \"edited\";\n");
  const auto resumed = run({"resume", "can-gimbal.sweep"});
  EXPECT_EQ(resumed.code, 2);
  EXPECT_THAT(resumed.err, HasSubstr("odrive-cansimple.dbc: has changed since the run of "
                                     "can-gimbal.sweep began; put it back to go on with that"));
  const auto night = run({"night", "night.toml"});
  EXPECT_EQ(night.code, 2);
  EXPECT_THAT(night.err, HasSubstr("odrive-cansimple.dbc: has changed since the run of "
                                   "out/can-gimbal-1.sweep began"));
  EXPECT_THAT(run({"run", "--resume", "can-gimbal.toml"}).err,
              HasSubstr("odrive-cansimple.dbc has changed since: a new sweep begins"));
}

TEST_F(Resume, MarksAKilledPart) {
  killed_at(60);
  EXPECT_THAT(run({"show", "run.sweep"}).out, HasSubstr("outcome  not finished"));
  const auto resumed = run({"resume", "run.sweep", "--json"});
  EXPECT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_THAT(run({"show", "run.sweep"}).out, HasSubstr("from dwell 1: killed"));
  EXPECT_THAT(run({"export", "run.sweep", "--format", "json"}).out,
              HasSubstr("\"outcome\": \"killed\""));
}

// Killed behind the last dwell, before its modelled points had been held against each other.
TEST_F(Resume, SaysThatAModelledSweepIsNotReviewed) {
  write("rig.toml",
        "[loop]\nrate_hz = 1000\n"
        "[sweep]\nstart_hz = 1\nstop_hz = 100\npoints = 12\namplitude = 1\nsettling = \"model\"\n"
        "check_fraction = 0\n[limits]\n[actuator]\n[sensor.y]\nnoise_rms = 1e-5\n"
        "[plant]\nkind = \"mechanical\"\ninertia = 0.02\ndamping = 0.1\nstiffness = 50\n");
  ASSERT_EQ(run({"run", "rig.toml", "--no-report"}).code, 0);
  record::Database{path("rig.sweep"), record::Database::Mode::write}.execute(
      "UPDATE part SET outcome = NULL, finished_utc = NULL; DELETE FROM run WHERE key = 'outcome'");
  const auto resumed = run({"resume", "rig.sweep"});
  EXPECT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_THAT(resumed.err, HasSubstr("rig.sweep: its modelled points are not held against a model "
                                     "of the whole sweep any more"));
  const auto stored = record::read_sweep(path("rig.sweep"));
  EXPECT_EQ(stored.events.back().kind, "model_doubted");
  EXPECT_EQ(stored.events.back().value, 5.0);
}

TEST_F(Resume, ARunStoppedByALimitStopsThereAgain) {
  std::string text = rig("", "4");
  text.replace(text.find("[sensor.y]\n"), 11, "[sensor.y]\nmax = 0.2\n");
  write("rig.toml", text);
  EXPECT_EQ(run({"run", "rig.toml"}).code, 3);
  const auto resumed = run({"resume", "rig.sweep"});
  EXPECT_EQ(resumed.code, 3);
  EXPECT_THAT(resumed.err, HasSubstr("is outside its limit 0.2"));
  const auto stored = record::read_sweep(path("rig.sweep"));
  ASSERT_EQ(stored.parts.size(), 2U);
  EXPECT_EQ(stored.parts[0].outcome, "stopped");
  EXPECT_EQ(stored.parts[1].outcome, "stopped");
  EXPECT_EQ(stored.fact("outcome"), "stopped");
}

TEST_F(Resume, AFullDiskStopsTheRunAndTheFileSaysWhy) {
  write("rig.toml", rig("", "4"));
  const auto stopped = faulty("full=100000", "run rig.toml -o run.sweep --quiet");
  EXPECT_EQ(stopped.code, 3) << stopped.err;
  EXPECT_THAT(stopped.err, HasSubstr("database or disk is full"));
  const auto stored = record::read_sweep(path("run.sweep"));
  EXPECT_EQ(stored.fact("outcome"), "stopped");
  EXPECT_THAT(stored.fact("outcome_detail"), HasSubstr("the recorder no longer takes points"));
  EXPECT_THAT(stored.fact("outcome_detail"), HasSubstr("database or disk is full"));
  EXPECT_FALSE(fs::exists(path("run.sweep-spare")));
  EXPECT_EQ(run({"resume", "run.sweep"}).code, 0);
}

TEST_F(Resume, ADiskThatBecomesReadOnlyStopsTheRun) {
  write("rig.toml", rig("", "4"));
  const auto stopped = faulty("fails=60", "run rig.toml -o run.sweep --quiet");
  EXPECT_EQ(stopped.code, 3);
  EXPECT_THAT(stopped.err, HasSubstr("run.sweep: cannot be "));
  EXPECT_THAT(stopped.err, HasSubstr("disk I/O error"));
  EXPECT_EQ(record::read_sweep(path("run.sweep")).fact("outcome"), "") << "it could not be told";
  EXPECT_EQ(run({"resume", "run.sweep"}).code, 0);
}

TEST_F(Resume, ADiskThatIsTooSlowStopsTheRun) {
  write("rig.toml", rig("clock = \"monotonic\"", "40"));
  const auto stopped = faulty("slow=300", "run rig.toml -o run.sweep --quiet");
  EXPECT_EQ(stopped.code, 3);
  EXPECT_THAT(stopped.err, HasSubstr("the disk took longer over a finished point than [output] "
                                     "max_lag_s allows"));
  EXPECT_EQ(record::read_sweep(path("run.sweep")).fact("outcome"), "stopped");
}

TEST_F(Resume, TheLastPointWaitsForTheDiskAsAllDo) {
  std::string text = rig("clock = \"monotonic\"", "4");
  text.replace(text.find("[50, 20, 10]"), 12, "[50]");
  text.replace(text.find("max_lag_s = 0.05"), 16, "max_lag_s = 10");
  write("rig.toml", text);
  EXPECT_EQ(faulty("slow=100", "run rig.toml -o run.sweep --quiet --no-report").code, 0);
  EXPECT_GE(record::read_sweep(path("run.sweep")).lag_s.at(0), 0.1);
}

// `sinerig run --resume`: what a service manager calls again and again.
class RunOrResume : public Resume {
 protected:
  void unfinished(const std::string& name) const {
    record::Database{path(name), record::Database::Mode::write}.execute(
        "DELETE FROM timing WHERE dwell = (SELECT max(dwell) FROM timing); "
        "UPDATE part SET outcome = NULL; DELETE FROM run WHERE key = 'outcome'");
  }
};

TEST_F(RunOrResume, GoesOnWithTheLastSweepOnlyWhereThatEndedEarly) {
  write("rig.toml", rig("", "4"));
  ASSERT_EQ(run({"run", "rig.toml", "--resume", "--no-report"}).code, 0);
  unfinished("rig.sweep");
  const auto resumed = run({"run", "rig.toml", "--resume", "--no-report"});
  EXPECT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_THAT(resumed.err, HasSubstr("rig.sweep: 2 of 3 dwells are finished, 1 to go"));
  EXPECT_EQ(record::read_sweep(path("rig.sweep")).parts.size(), 2U);
  EXPECT_FALSE(fs::exists(path("rig-2.sweep")));

  EXPECT_EQ(run({"run", "rig.toml", "--resume", "--no-report"}).code, 0);
  EXPECT_EQ(record::read_sweep(path("rig.sweep")).parts.size(), 2U);
  EXPECT_EQ(record::read_sweep(path("rig-2.sweep")).fact("outcome"), "done");
}

TEST_F(RunOrResume, TheLastIsTheOneWithTheHighestNumber) {
  write("rig.toml", rig("", "4"));
  for (const char* name : {"rig.sweep", "rig-9.sweep", "rig-10.sweep", "rig-11x.sweep",
                           "rig-.sweep", "rigid-20.sweep", "rig-12.run"}) {
    ASSERT_EQ(run({"run", "rig.toml", "-o", name, "--no-report"}).code, 0);
    unfinished(name);
  }
  ASSERT_EQ(run({"run", "rig.toml", "--resume", "--no-report"}).code, 0);
  EXPECT_EQ(record::read_sweep(path("rig-10.sweep")).fact("outcome"), "done");
  EXPECT_EQ(record::read_sweep(path("rig-9.sweep")).fact("outcome"), "");
}

TEST_F(RunOrResume, BeginsAnewWhereTheRigFileIsAnother) {
  write("rig.toml", rig("", "4"));
  ASSERT_EQ(run({"run", "rig.toml", "--no-report"}).code, 0);
  unfinished("rig.sweep");
  write("rig.toml", rig("", "9"));
  const auto anew = run({"run", "rig.toml", "--resume", "--no-report"});
  EXPECT_EQ(anew.code, 0) << anew.err;
  EXPECT_THAT(anew.err,
              HasSubstr("rig.sweep is not finished, but rig.toml has changed since: a new sweep "
                        "begins"));
  EXPECT_EQ(record::read_sweep(path("rig.sweep")).fact("outcome"), "");
  EXPECT_EQ(record::read_sweep(path("rig-2.sweep")).fact("rig_text"), rig("", "9"));
}

TEST_F(RunOrResume, BeginsAnewWhereNothingCanBeResumed) {
  write("rig.toml", rig("", "4"));
  write("rig.sweep", "");  // of a run that was killed before it began
  EXPECT_EQ(run({"run", "rig.toml", "--resume", "--no-report"}).code, 0);
  write("rig-3.sweep", std::string(2000, 'x'));
  const auto anew = run({"run", "rig.toml", "--resume", "--no-report"});
  EXPECT_EQ(anew.code, 0);
  EXPECT_THAT(anew.err, HasSubstr("; a new sweep begins"));
  EXPECT_EQ(record::read_sweep(path("rig-4.sweep")).fact("outcome"), "done");
}

TEST_F(RunOrResume, RefusesWhereThatSweepStillGoesOn) {
  write("rig.toml", rig("clock = \"monotonic\"", "100"));
  test::Program program{{"run", "rig.toml", "--json", "--resume"}, folder_};
  program.read_line();
  program.read_line();  // a point: it runs
  const auto second = run({"run", "rig.toml", "--resume"});
  EXPECT_EQ(second.code, 2);
  EXPECT_THAT(second.err, HasSubstr("rig.sweep: is being written by a sinerig that still runs"));
  EXPECT_FALSE(fs::exists(path("rig-2.sweep")));
  EXPECT_EQ(run({"run", "rig.toml", "--resume", "--force"}).code, 2);
}

}  // namespace
}  // namespace sinerig
