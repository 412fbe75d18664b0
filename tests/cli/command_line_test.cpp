// The commands end to end: output, files and exit codes.
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "record/database.h"
#include "record/sweep_reader.h"
#include "support/process.h"

namespace sinerig {
namespace {

using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

// Three turns of dead time at the highest frequency, so that the phase has to be unwrapped.
constexpr const char* rig_text =
    "[loop]\nrate_hz = 1000\n"
    "[sweep]\nstart_hz = 1\nstop_hz = 100\npoints = 30\namplitude = 0.5\n"
    "settling = \"fixed\"\nsettle_s = 0.5\nintegrate_s = 0.3\ntarget_db = 0\ntarget_deg = 0\n"
    "[limits]\n[actuator]\nunit = \"V\"\n[sensor.gyro]\nunit = \"rad/s\"\n"
    "[plant]\nkind = \"transfer_function\"\nnum = [60]\nden = [1, 60]\ndelay_s = 0.03\n";

class CommandLine : public test::ProgramTest {
 protected:
  CommandLine() { write("rig.toml", rig_text); }
};

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream{text};
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

TEST_F(CommandLine, ChecksARigWithoutMovingIt) {
  const auto checked = run({"check", "rig.toml", "--seconds", "0.5"});
  EXPECT_EQ(checked.code, 0) << checked.err;
  EXPECT_THAT(checked.out, HasSubstr("500 ticks, 0 skipped"));
  EXPECT_THAT(checked.out, HasSubstr("gyro             1000.00     0.000     0.000     0.000     "
                                     "0.0000      0  0 rad/s"));
  EXPECT_THAT(checked.out, HasSubstr("nothing was found that would stop a sweep"));
}

TEST_F(CommandLine, CheckSaysWhatWouldStopASweep) {
  std::string text = rig_text;
  const std::string sensor = "[sensor.gyro]\n";
  text.insert(text.find(sensor) + sensor.size(), "lost_fraction = 0.2\nbias = 3\nmax = 2\n");
  text.replace(text.find("amplitude = 0.5"), 15, "amplitude = 9");
  text.insert(text.find("[limits]\n") + 9, "command_max = 5\n");
  write("bad.toml", text);
  const auto checked = run({"check", "bad.toml"});
  EXPECT_EQ(checked.code, 3) << checked.err;
  EXPECT_THAT(checked.out, HasSubstr("would stop a sweep:\n"));
  EXPECT_THAT(checked.out, HasSubstr("gyro = 3 is outside its limit 2\n"));
  EXPECT_THAT(checked.out, HasSubstr("bad.toml:"));
  EXPECT_THAT(checked.out, Not(HasSubstr("0.0000      0  3 rad/s"))) << "losses are counted";
  EXPECT_EQ(run({"check", "none.toml"}).code, 2);
}

TEST_F(CommandLine, RunsShowsAndExports) {
  const auto ran = run({"run", "rig.toml"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("outcome  done"));
  EXPECT_THAT(ran.err, HasSubstr("wrote rig.sweep"));
  EXPECT_EQ(record::read_sweep(path("rig.sweep")).responses.at(0).points.size(), 30U);

  const auto shown = run({"show", "rig.sweep"});
  EXPECT_EQ(shown.code, 0);
  EXPECT_THAT(shown.out, HasSubstr("gyro / applied   (rad/s per V)"));

  const auto csv = run({"export", "rig.sweep", "--format", "csv"});
  EXPECT_EQ(csv.code, 0);
  const auto rows = lines_of(csv.out);
  ASSERT_EQ(rows.size(), 31U);
  EXPECT_THAT(rows[0], StartsWith("freq_hz,re,im,gain_db,phase_deg"));
  double before = 0.0;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    std::vector<double> values;
    std::istringstream row{rows[i]};
    for (std::string value; values.size() < 5 && std::getline(row, value, ',');) {
      values.push_back(std::stod(value));
    }
    ASSERT_EQ(values.size(), 5U);
    EXPECT_NEAR(values[3], 20.0 * std::log10(std::hypot(values[1], values[2])), 1e-9);
    EXPECT_LT(values[4], before);  // never jumps back by a turn
    before = values[4];
  }
  EXPECT_LT(before, -360.0 * 2.9);
}

TEST_F(CommandLine, ExportsEverythingAsJson) {
  ASSERT_EQ(run({"run", "rig.toml"}).code, 0);
  const auto exported = run({"export", "rig.sweep", "--format", "json", "-o", "rig.json"});
  EXPECT_EQ(exported.code, 0);
  EXPECT_EQ(exported.out, "");
  const auto json = nlohmann::json::parse(read("rig.json"));
  EXPECT_EQ(json.at("rate_hz"), 1000.0);
  EXPECT_EQ(json.at("rig").at("text"), rig_text);
  EXPECT_EQ(json.at("responses").at(0).at("points").size(), 30U);
  EXPECT_EQ(json.at("responses")[0].at("output"), "gyro");
  EXPECT_EQ(json.at("channels").size(), 3U);
  EXPECT_EQ(json.at("plan").size(), 30U);
}

TEST_F(CommandLine, NeverOverwritesWithoutForce) {
  ASSERT_EQ(run({"run", "rig.toml", "-o", "a.sweep"}).code, 0);
  const auto again = run({"run", "rig.toml", "-o", "a.sweep"});
  EXPECT_EQ(again.code, 2);
  EXPECT_THAT(again.err, HasSubstr("a.sweep: exists already; choose another name with -o, or "
                                   "--force to replace it"));
  EXPECT_EQ(run({"run", "rig.toml", "-o", "a.sweep", "--force"}).code, 0);
  ASSERT_EQ(run({"export", "a.sweep", "-o", "a.csv"}).code, 0);
  EXPECT_EQ(run({"export", "a.sweep", "-o", "a.csv"}).code, 2);
  EXPECT_EQ(run({"export", "a.sweep", "-o", "a.csv", "--force"}).code, 0);
}

// A measurement is not to be had again by trying; nor is what a command reads.
TEST_F(CommandLine, NeverOverwritesAMeasurementOrAnInputEvenWithForce) {
  ASSERT_EQ(run({"run", "rig.toml", "-o", "a.sweep"}).code, 0);
  ASSERT_EQ(run({"run", "rig.toml", "-o", "b.sweep"}).code, 0);
  ASSERT_EQ(run({"export", "a.sweep", "-o", "a.csv"}).code, 0);
  const std::vector<std::vector<std::string>> commands{
      {"export", "a.sweep", "-o", "a.sweep"},
      {"export", "a.sweep", "-o", "b.sweep"},
      {"export", "a.sweep", "--format", "mat", "-o", "b.sweep"},
      {"export", "a.csv", "-o", "./a.csv"},
      {"report", "a.sweep", "-o", "a.sweep"},
      {"report", "a.sweep", "--format", "svg", "-o", "b.sweep"},
      {"compare", "a.csv", "b.sweep", "-o", "a.csv"},
      {"compare", "a.csv", "b.sweep", "-o", "b.sweep"},
      {"run", "rig.toml", "-o", "rig.toml"},
      {"run", "rig.toml", "-o", "notes"}};
  write("notes", "mine");
  for (std::vector<std::string> command : commands) {
    const std::vector<std::string> before{read("a.sweep"), read("b.sweep"), read("a.csv"),
                                          read("rig.toml"), read("notes")};
    command.emplace_back("--force");
    const auto refused = run(command);
    EXPECT_EQ(refused.code, 2) << command.front() << ' ' << command[command.size() - 2];
    EXPECT_THAT(refused.err, HasSubstr("error: "));
    EXPECT_EQ(before, (std::vector<std::string>{read("a.sweep"), read("b.sweep"), read("a.csv"),
                                                read("rig.toml"), read("notes")}));
  }
}

TEST_F(CommandLine, LeavesASweepUnderTheNameOfASweep) {
  for (const char* name : {"k.csv", "k.MAT", "k.html"}) {
    const auto refused = run({"run", "rig.toml", "-o", name});
    EXPECT_EQ(refused.code, 2);
    EXPECT_THAT(refused.err, HasSubstr("a run leaves a sweep file; call it NAME.sweep"));
    EXPECT_FALSE(std::filesystem::exists(path(name)));
  }
}

TEST_F(CommandLine, FitsWhatItMayNotStoreIn) {
  ASSERT_EQ(run({"run", "rig.toml", "--no-report"}).code, 0);
  record::Database{path("rig.sweep"), record::Database::Mode::write}.execute(
      "CREATE TABLE fit (id INTEGER PRIMARY KEY, created_utc TEXT, input INTEGER, output INTEGER, "
      "method TEXT, json TEXT);"
      "CREATE TRIGGER refuse BEFORE INSERT ON fit BEGIN SELECT RAISE(ABORT, 'read only'); END");
  for (const char* command : {"fit", "margins"}) {
    const auto fitted = run({command, "rig.sweep"});
    EXPECT_EQ(fitted.code, 0) << fitted.err;
    EXPECT_THAT(fitted.err, HasSubstr("the fit is not stored: rig.sweep"));
    EXPECT_NE(fitted.out, "");
  }
}

TEST_F(CommandLine, ComparesWhatWasNotMeasuredAsLost) {
  ASSERT_EQ(run({"run", "rig.toml", "-o", "whole.sweep", "--no-report"}).code, 0);
  for (const auto& [outcome, kept] : {std::pair{"killed", 2}, {"stopped", 28}}) {
    std::filesystem::copy_file(path("whole.sweep"), path("cut.sweep"),
                               std::filesystem::copy_options::overwrite_existing);
    const std::string sql = "DELETE FROM point WHERE dwell >= " + std::to_string(kept) +
                            "; UPDATE run SET value = '" + outcome + "' WHERE key = 'outcome'";
    record::Database{path("cut.sweep"), record::Database::Mode::write}.execute(sql);
    const auto compared = run({"compare", "whole.sweep", "cut.sweep"});
    EXPECT_THAT(compared.err, HasSubstr("cut: its run is not done (" + std::string{outcome} +
                                        "): " + std::to_string(30 - kept) + " planned points"));
    EXPECT_EQ(compared.code, kept == 2 ? 5 : 0) << compared.out;
    if (kept == 2) {
      EXPECT_THAT(compared.out, HasSubstr("changed: points are lost, though no change in the other "
                                          "2 points"));
      EXPECT_THAT(compared.out, HasSubstr("28 were good and are not any more"));
    }
  }
}

TEST_F(CommandLine, NumbersTheDefaultOutput) {
  ASSERT_EQ(run({"run", "rig.toml"}).code, 0);
  ASSERT_EQ(run({"run", "rig.toml"}).code, 0);
  ASSERT_EQ(run({"run", "rig.toml"}).code, 0);
  for (const char* name : {"rig.sweep", "rig-2.sweep", "rig-3.sweep"}) {
    EXPECT_TRUE(std::filesystem::exists(path(name))) << name;
  }
}

TEST_F(CommandLine, PrintsPlainLinesWhenPiped) {
  const auto ran = run({"run", "rig.toml"});
  EXPECT_THAT(ran.out, HasSubstr("   1/30 "));
  EXPECT_THAT(ran.out, HasSubstr("  30/30 "));
  EXPECT_THAT(ran.out, Not(HasSubstr("\033")));
  EXPECT_THAT(ran.out, Not(HasSubstr("\r")));
  EXPECT_THAT(ran.err, Not(HasSubstr("\033")));
}

TEST_F(CommandLine, PlansWithoutLeavingAFile) {
  const auto planned = run({"plan", "rig.toml"});
  EXPECT_EQ(planned.code, 0);
  for (const char* word : {"asked Hz", "exact Hz", "amplitude", "velocity", "acceleration",
                           "30 points", "of bench time"}) {
    EXPECT_THAT(planned.out, HasSubstr(word));
  }
  EXPECT_FALSE(std::filesystem::exists(path("rig.sweep")));
}

TEST_F(CommandLine, RunsWithItsStandardInputClosed) {
  const auto ran =
      test::Program{{"run", "rig.toml"}, folder_, test::Program::Stdin::closed}.finish();
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_EQ(run({"show", "rig.sweep"}).code, 0);
}

TEST_F(CommandLine, HelpsAndTellsItsVersion) {
  const auto help = run({"--help"});
  EXPECT_EQ(help.code, 0);
  for (const char* word : {"plan", "run", "show", "export", "Exit codes", "config/"}) {
    EXPECT_THAT(help.out, HasSubstr(word));
  }
  const auto version = run({"--version"});
  EXPECT_EQ(version.code, 0);
  EXPECT_THAT(version.out, testing::MatchesRegex("sinerig [0-9]+\\.[0-9]+\\.[0-9]+\n"));
  EXPECT_EQ(run({"run", "--help"}).code, 0);
}

TEST_F(CommandLine, CallsBadUsageTwo) {
  EXPECT_EQ(run({}).code, 2);
  EXPECT_EQ(run({"fly"}).code, 2);
  EXPECT_EQ(run({"run"}).code, 2);
  EXPECT_EQ(run({"export", "a.sweep", "--format", "xls"}).code, 2);
  EXPECT_EQ(run({"plan", "rig.toml", "--log-level", "loud"}).code, 2);
}

TEST_F(CommandLine, NamesTheCommandThatWasMeant) {
  EXPECT_THAT(run({"fitt", "a.sweep"}).err,
              HasSubstr("there is no command \"fitt\"; did you mean fit?"));
  EXPECT_THAT(run({"--log-level", "info", "fly"}).err,
              HasSubstr("there is no command \"fly\"; sinerig --help lists them"));
  const auto help = run({"help"});
  EXPECT_EQ(help.code, 0);
  EXPECT_EQ(help.out, run({"--help"}).out);
}

TEST_F(CommandLine, SaysOfAJobFileThatItIsOne) {
  write("job.toml", "[night]\n[[night.sweep]]\nrig = \"rig.toml\"\n");
  const auto refused = run({"run", "job.toml"});
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, HasSubstr("job.toml: is a job file, no rig file; `sinerig night"));
}

// What the README shows is what is said.
TEST_F(CommandLine, NamesTheKeyThatWasMeantWhereOneIsMissing) {
  const auto text_of = [](const std::string& name) -> std::string {
    std::ifstream stream{SINERIG_SOURCE_DIR "/" + name};
    return {std::istreambuf_iterator<char>{stream}, {}};
  };
  std::string text = text_of("config/gimbal.toml");
  const std::string readme = text_of("README.md");
  text.replace(text.find("\nstart_hz"), 9, "\nstrat_hz");
  std::filesystem::create_directory(path("config"));
  write("config/gimbal.toml", text);
  const auto refused = run({"plan", "config/gimbal.toml"});
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, HasSubstr("strat_hz: unknown key; did you mean start_hz?"));
  EXPECT_THAT(readme, HasSubstr(refused.err));
}

// It would sit in its first tick for hours, and no signal would end it.
TEST_F(CommandLine, RefusesAPlantTooFastToBeSimulated) {
  std::string text = rig_text;
  text.replace(text.find("den = [1, 60]"), 13, "den = [1e-20, 60]");
  write("stiff.toml", text);
  const auto refused = run({"plan", "stiff.toml"});
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, HasSubstr("too fast to be simulated at the rate of the loop"));
}

TEST_F(CommandLine, CallsABadRigFileTwoWithItsPlace) {
  std::string text = rig_text;
  text.replace(text.find("stop_hz = 100"), 13, "stop_hz = 900");
  write("bad.toml", text);
  for (const char* command : {"plan", "run"}) {
    const auto refused = run({command, "bad.toml"});
    EXPECT_EQ(refused.code, 2);
    EXPECT_EQ(refused.err,
              "error: bad.toml:5: [sweep] stop_hz = 900: must be below half the loop "
              "rate (500 Hz)\n");
  }
  EXPECT_FALSE(std::filesystem::exists(path("bad.sweep")));
  EXPECT_EQ(run({"plan", "nowhere.toml"}).code, 2);
  EXPECT_EQ(run({"plan", "."}).code, 2);
}

TEST_F(CommandLine, CallsABadSweepFileOneWithAMessage) {
  const auto missing = run({"show", "none.sweep"});
  EXPECT_EQ(missing.code, 1);
  EXPECT_EQ(missing.err, "error: none.sweep: does not exist\n");
  EXPECT_EQ(run({"show", "rig.toml"}).code, 1);
  ASSERT_EQ(run({"run", "rig.toml"}).code, 0);
  const auto channel = run({"export", "rig.sweep", "--channel", "gyr"});
  EXPECT_EQ(channel.code, 1);
  EXPECT_THAT(channel.err, HasSubstr("has no response of \"gyr\"; it has gyro"));
}

TEST_F(CommandLine, RefusesOptionsWithoutEffect) {
  ASSERT_EQ(run({"run", "rig.toml", "--no-report"}).code, 0);
  const auto channel = run({"report", "rig.sweep", "--channel", "gyr"});
  EXPECT_EQ(channel.code, 1);
  EXPECT_THAT(channel.err, HasSubstr("has no response of \"gyr\"; it has gyro"));
  EXPECT_EQ(run({"report", "rig.sweep", "--channel", "gyro"}).code, 0);
  const auto compared = run({"compare", "rig.sweep", "rig.sweep", "--channel", "gyro"});
  EXPECT_EQ(compared.code, 2);
  EXPECT_THAT(compared.err, HasSubstr("--channel chooses the sensor whose model --drift compares"));
  for (const char* option : {"--rate", "--prewarp"}) {
    const auto fitted = run({"fit", "rig.sweep", option, "100"});
    EXPECT_EQ(fitted.code, 2);
    EXPECT_THAT(fitted.err, HasSubstr("--rate and --prewarp belong to --discrete"));
  }
  EXPECT_EQ(run({"fit", "rig.sweep", "--hold", "0", "--no-store", "--json"}).out,
            run({"fit", "rig.sweep", "--hold", "none", "--no-store", "--json"}).out);
}

TEST_F(CommandLine, SaysOfEveryFileWhatItIs) {
  std::filesystem::create_directory(path("adir"));
  write("junk.sweep", "no sweep at all, but a line of text\n");
  for (const char* command : {"show", "report", "export", "fit", "margins", "notch"}) {
    const auto folder = run({command, "adir"});
    EXPECT_EQ(folder.code, 1) << command;
    EXPECT_THAT(folder.err, HasSubstr("adir: is a folder; wanted a file")) << command;
    const auto junk = run({command, "junk.sweep"});
    EXPECT_EQ(junk.code, 1) << command;
    EXPECT_THAT(junk.err, testing::AllOf(HasSubstr("junk.sweep: "), HasSubstr("is not a database")))
        << command;
  }
}

TEST_F(CommandLine, CallsAStopByALimitThree) {
  std::string text = rig_text;
  text.replace(text.find("unit = \"rad/s\""), 14, "max = 0.3");
  write("limit.toml", text);
  const auto stopped = run({"run", "limit.toml"});
  EXPECT_EQ(stopped.code, 3);
  EXPECT_THAT(stopped.err, HasSubstr("is outside its limit 0.3"));
  EXPECT_EQ(record::read_sweep(path("limit.sweep")).fact("outcome"), "stopped");
}

constexpr const char* real_time_rig =
    "[loop]\nrate_hz = 500\nclock = \"monotonic\"\n"
    "[sweep]\nspacing = \"list\"\nfrequencies_hz = [50, SECOND]\namplitude = 0.5\n"
    "settling = \"fixed\"\nsettle_cycles = 1\nsettle_s = 0\nintegrate_cycles = 2\n"
    "integrate_s = 0\ntarget_db = 0\ntarget_deg = 0\n"
    "[limits]\nstop_ramp_s = 0.05\n[actuator]\n[sensor.y]\n"
    "[plant]\nkind = \"transfer_function\"\nnum = [60]\nden = [1, 60]\n";

std::string real_time_rig_with(const std::string& second_hz) {
  std::string text = real_time_rig;
  return text.replace(text.find("SECOND"), 6, second_hz);
}

class StopSignal : public test::ProgramTest, public testing::WithParamInterface<int> {};

// The first point shows that the loop runs; the second would take minutes.
TEST_P(StopSignal, RampsReleasesAndLeavesAReadableFile) {
  write("rig.toml", real_time_rig_with("0.01"));
  test::Program program{{"run", "rig.toml"}, folder_};
  EXPECT_THAT(program.read_line(), StartsWith("   1/2 "));
  program.send(GetParam());
  const auto finished = program.finish();
  EXPECT_EQ(finished.code, 4) << finished.err;
  const auto stored = record::read_sweep(path("rig.sweep"));
  EXPECT_EQ(stored.fact("outcome"), "interrupted");
  EXPECT_THAT(stored.fact("outcome_detail"), HasSubstr("stop requested"));
  std::vector<std::string> kinds;
  for (const auto& event : stored.events) kinds.push_back(event.kind);
  EXPECT_THAT(kinds, testing::IsSupersetOf({"tripped", "released", "finished"}));
  ASSERT_EQ(stored.responses.at(0).points.size(), 2U);
  EXPECT_EQ(stored.responses[0].points[0].status, "stopped");  // the lower frequency, under way
}

INSTANTIATE_TEST_SUITE_P(Each, StopSignal, testing::Values(SIGINT, SIGTERM, SIGHUP));

class AFileTakenAway : public test::ProgramTest {};

// The first point is on the disk; the second would take minutes.
TEST_F(AFileTakenAway, EndsTheRunAndIsKept) {
  write("rig.toml", real_time_rig_with("0.01"));
  test::Program program{{"run", "rig.toml"}, folder_};
  EXPECT_THAT(program.read_line(), StartsWith("   1/2 "));
  std::filesystem::remove(path("rig.sweep"));
  const auto finished = program.finish();
  EXPECT_EQ(finished.code, 3) << finished.err;
  EXPECT_THAT(finished.err, HasSubstr("rig.sweep: was removed, renamed or replaced"));
  EXPECT_EQ(record::read_sweep(path("rig.sweep-rescued")).responses.at(0).points.back().status,
            "good");
  EXPECT_FALSE(std::filesystem::exists(path("rig.sweep-wal")));
}

class AReader : public test::ProgramTest {};

TEST_F(AReader, ThatGoesAwayDoesNotEndTheRun) {
  write("rig.toml", real_time_rig_with("20"));
  test::Program program{{"run", "rig.toml"}, folder_};
  program.read_line();
  program.close_output();
  EXPECT_EQ(program.finish().code, 0);
  EXPECT_EQ(record::read_sweep(path("rig.sweep")).fact("outcome"), "done");
}

class AKilledRun : public test::ProgramTest {};

TEST_F(AKilledRun, LeavesAFileThatCanBeShown) {
  write("rig.toml", real_time_rig_with("0.01"));
  {
    test::Program program{{"run", "rig.toml"}, folder_};
    program.read_line();
    program.send(SIGKILL);
    EXPECT_EQ(program.finish().code, -SIGKILL);
  }
  const auto shown = run({"show", "rig.sweep"});
  EXPECT_EQ(shown.code, 0) << shown.err;
  EXPECT_THAT(shown.out, HasSubstr("not finished"));
}

}  // namespace
}  // namespace sinerig
