// `sinerig night`: several sweeps as one job.
#include <csignal>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <thread>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "cli/night_command.h"
#include "drivers/device.h"
#include "record/database.h"
#include "record/sweep_reader.h"
#include "sim/sim_driver.h"
#include "support/process.h"

namespace sinerig {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr const char* rig_text =
    "[loop]\nrate_hz = 500\n"
    "[sweep]\nstart_hz = 1\nstop_hz = 50\npoints = 5\namplitude = 0.5\nintegrate_s = 1\n"
    "[limits]\n[actuator]\n[sensor.y]\nnoise_rms = 1e-3\n"
    "[plant]\nkind = \"transfer_function\"\nnum = [60]\nden = [1, 60]\n";

class Night : public test::ProgramTest {
 protected:
  Night() { write("axis.toml", rig_text); }

  void job(const std::string& sweeps, const std::string& keys = "") const {
    write("night.toml", "[night]\nfolder = \"out\"\n" + keys + sweeps);
  }
  nlohmann::json summary() const { return nlohmann::json::parse(read("out/summary.json")); }
};

// Remembers what it was asked to wait for.
class WatchedTime final : public cli::WallTime {
 public:
  explicit WatchedTime(std::int64_t start_s) : time_{start_s} {}
  std::int64_t now_s() override { return time_.now_s() + step_s_; }
  double elapsed_s() override { return time_.elapsed_s(); }
  bool wait_until(std::int64_t time_s, const std::atomic<int>& stop_requests,
                  const Meanwhile& meanwhile) override {
    waits.push_back(time_s - now_s());
    const bool go = time_.wait_for(static_cast<double>(time_s - now_s()), stop_requests, meanwhile);
    return go;
  }
  bool wait_for(double seconds, const std::atomic<int>& stop_requests,
                const Meanwhile& meanwhile) override {
    pauses.push_back(seconds);
    const bool go = time_.wait_for(seconds, stop_requests, meanwhile);
    step_s_ += step_in_pause_s;
    if (raised_after_wait != 0) std::raise(raised_after_wait);
    if (raised_in_pause == pauses.size()) std::raise(SIGTERM);
    return go;
  }
  void pass(double seconds) override {
    time_.pass(seconds);
    step_s_ += step_after_sweep_s;
    if (raised_after_sweep != 0) std::raise(raised_after_sweep);
  }

  std::vector<std::int64_t> waits;  // by the time of day
  std::vector<double> pauses;
  std::int64_t step_after_sweep_s = 0;  // of the clock
  std::int64_t step_in_pause_s = 0;     // likewise
  std::size_t raised_in_pause = 0;      // SIGTERM, in this one, from 1
  int raised_after_wait = 0;            // signals
  int raised_after_sweep = 0;

 private:
  cli::PassingTime time_;
  std::int64_t step_s_ = 0;
};

TEST_F(Night, RunsEverySweepAndTellsWhatChanged) {
  job("[[night.sweep]]\nrig = \"axis.toml\"\nrepeat = 3\n"
      "[[night.sweep]]\nname = \"small\"\nrig = \"axis.toml\"\nset.sweep.amplitude = 0.25\n");
  const auto ran = run({"night", "night.toml"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.err, HasSubstr("axis-2, 2 of 4"));
  EXPECT_THAT(ran.out, HasSubstr("axis-3 y: same in 5 points; most at "));
  EXPECT_EQ(read("out/summary.txt"), ran.out.substr(ran.out.find("night    night.toml")));
  const auto json = summary();
  EXPECT_EQ(json.at("changed"), false);
  ASSERT_EQ(json.at("sweeps").size(), 4U);
  EXPECT_EQ(json["sweeps"][1].at("outcome"), "done");
  EXPECT_EQ(json["sweeps"][1].at("good"), 5);
  EXPECT_EQ(json["sweeps"][1].at("differences").at(0).at("points").size(), 5U);
  const auto small = record::read_sweep(path("out/small-1.sweep"));
  EXPECT_THAT(small.fact("rig_text"), HasSubstr("amplitude = 0.25\n"));
  EXPECT_NEAR(small.responses.at(0).points.at(0).input_amplitude, 0.25, 1e-9);
  // A noise of its own for each repeat: otherwise their agreement would say nothing.
  const auto first = record::read_sweep(path("out/axis-1.sweep"));
  const auto second = record::read_sweep(path("out/axis-2.sweep"));
  EXPECT_NE(first.responses.at(0).points.at(0).response,
            second.responses.at(0).points.at(0).response);
  EXPECT_THAT(second.fact("rig_text"), HasSubstr("seed = 2"));
}

TEST_F(Night, CalledAgainDoesNothingTwice) {
  job("[[night.sweep]]\nrig = \"axis.toml\"\nrepeat = 2\n");
  ASSERT_EQ(run({"night", "night.toml"}).code, 0);
  const std::string before = read("out/axis-1.sweep") + read("out/axis-2.sweep");
  const std::string summary_before = read("out/summary.txt");
  EXPECT_EQ(run({"night", "night.toml", "--quiet"}).code, 0);
  EXPECT_EQ(read("out/axis-1.sweep") + read("out/axis-2.sweep"), before);
  EXPECT_EQ(read("out/summary.txt"), summary_before);
}

TEST_F(Night, GoesOnWhereItWasKilled) {
  std::string text = rig_text;
  text.insert(text.find("rate_hz"), "clock = \"monotonic\"\n");
  text.replace(text.find("integrate_s = 1"), 15, "integrate_s = 0.2");
  write("slow.toml", text);
  job("[[night.sweep]]\nrig = \"axis.toml\"\n[[night.sweep]]\nrig = \"slow.toml\"\n");
  {
    test::Program program{{"night", "night.toml", "--json"}, folder_};
    std::string line;
    do line = program.read_line();
    while (!line.empty() && line.find("\"slow\"") == std::string::npos);
    program.read_line();  // the plan
    EXPECT_THAT(program.read_line(), HasSubstr("\"point\""));
    program.send(SIGKILL);
    program.finish();
  }
  const std::string axis = read("out/axis-1.sweep");
  const auto again = run({"night", "night.toml"});
  EXPECT_EQ(again.code, 0) << again.err;
  EXPECT_THAT(again.err, HasSubstr("slow-1, 2 of 2, goes on"));
  EXPECT_EQ(read("out/axis-1.sweep"), axis);
  EXPECT_EQ(record::read_sweep(path("out/slow-1.sweep")).parts.size(), 2U);
  EXPECT_EQ(summary().at("sweeps").at(1).at("parts"), 2);
}

TEST_F(Night, IsStoppedByASignalAndResumed) {
  std::string text = rig_text;
  text.insert(text.find("rate_hz"), "clock = \"monotonic\"\n");
  // The second point takes a minute, however slow the machine is at the first.
  const std::string grid = "start_hz = 1\nstop_hz = 50\npoints = 5\n";
  text.replace(text.find(grid), grid.size(), "spacing = \"list\"\nfrequencies_hz = [50, 0.02]\n");
  write("slow.toml", text);
  job("[[night.sweep]]\nrig = \"slow.toml\"\nrepeat = 2\n");
  test::Program program{{"night", "night.toml", "--json"}, folder_};
  for (int i = 0; i < 3; ++i) program.read_line();  // sweep, plan, point
  const auto second = run({"night", "night.toml"});
  EXPECT_EQ(second.code, 2);
  EXPECT_THAT(second.err, HasSubstr("another sinerig is at work on this night"));
  program.send(SIGINT);
  EXPECT_EQ(program.finish().code, 4);
  EXPECT_EQ(summary().at("sweeps").at(0).at("outcome"), "interrupted");
  EXPECT_EQ(summary().at("sweeps").at(1).at("outcome"), "not run");
}

TEST_F(Night, StopsInTheMidstOfWaiting) {
  std::string text = rig_text;
  text.insert(text.find("rate_hz"), "clock = \"monotonic\"\n");
  write("slow.toml", text);
  job("[[night.sweep]]\nrig = \"slow.toml\"\nstart_after_s = 100000\n");
  // The name of the file that it locks appears when it is ready for signals.
  test::Program program{{"night", "night.toml"}, folder_};
  while (!fs::exists(path("out/night.json"))) std::this_thread::yield();
  program.send(SIGTERM);
  EXPECT_EQ(program.finish().code, 4);
}

TEST_F(Night, WaitsForTheTimesOfTheJob) {
  job("[[night.sweep]]\nrig = \"axis.toml\"\nrepeat = 2\npause_s = 60\nstart_after_s = 1000\n");
  WatchedTime time{1772398800};
  const cli::NightOptions options{.job = path("night.toml"), .voice = cli::Voice::quiet};
  EXPECT_EQ(cli::run_night(options, {sim::sim_driver()}, time), 0);
  EXPECT_EQ(time.pauses, (std::vector<double>{1000, 60}));
  EXPECT_THAT(time.waits, testing::IsEmpty());
  EXPECT_GT(time.now_s(), 1772398800 + 1060) << "sweeps take their time, too";
}

// It would end a pause at once, or prolong it by as much.
TEST_F(Night, AStepOfTheClockChangesNoPause) {
  job("[[night.sweep]]\nrig = \"axis.toml\"\nrepeat = 2\npause_s = 60\n"
      "[[night.sweep]]\nname = \"late\"\nrig = \"axis.toml\"\nstart_after_s = 20000\n");
  for (const std::int64_t step_s : {-3600, 3600}) {
    fs::remove_all(path("out"));
    WatchedTime time{1772398800};
    time.step_after_sweep_s = time.step_in_pause_s = step_s;
    const cli::NightOptions options{.job = path("night.toml"), .voice = cli::Voice::quiet};
    EXPECT_EQ(cli::run_night(options, {sim::sim_driver()}, time), 0);
    ASSERT_EQ(time.pauses.size(), 3U);
    EXPECT_EQ(time.pauses[1], 60);
    EXPECT_LT(time.pauses[2], 20000 - 120);
    EXPECT_GT(time.pauses[2], 20000 - 120 - 100) << "two sweeps of less than a minute";
    EXPECT_THAT(time.waits, testing::IsEmpty());
  }
}

// A time of day is that of the clock on the wall, whoever sets it.
TEST_F(Night, AStepOfTheClockMovesATimeOfDay) {
  const std::int64_t start_s = 1772398800;
  const std::time_t at = start_s + 7200;
  char text[8];
  std::strftime(text, sizeof text, "%H:%M", std::localtime(&at));
  job("[[night.sweep]]\nrig = \"axis.toml\"\n"
      "[[night.sweep]]\nname = \"late\"\nrig = \"axis.toml\"\nstart_at = \"" +
      std::string{text} + "\"\n");
  WatchedTime time{start_s};
  time.step_after_sweep_s = 3600;
  const cli::NightOptions options{.job = path("night.toml"), .voice = cli::Voice::quiet};
  EXPECT_EQ(cli::run_night(options, {sim::sim_driver()}, time), 0);
  ASSERT_EQ(time.waits.size(), 1U);
  EXPECT_LT(time.waits[0], 3600);
  EXPECT_GT(time.waits[0], 3500);
}

struct Trouble {
  int refusals = 0;           // so many times the drive cannot be connected to
  int reads_until_open = -1;  // of the door; below 0: stays closed
  bool open = false;          // the door, from the beginning
  bool stays_on = false;      // cannot be armed
  std::string not_released;
};

// A simulated rig with a drive that may not answer; its second sensor is the interlock of a door.
class TroubledDevice final : public Device, public Sensor {
 public:
  TroubledDevice(DeviceRequest request, Trouble& trouble) : trouble_{trouble} {
    request.sensors.resize(1);
    device_ = sim::sim_driver().configure(request);
  }
  void open(const Clock& clock) override {
    clock_ = &clock;
    if (trouble_.refusals-- > 0) throw std::runtime_error{"no connection (Connection refused)"};
    device_->open(clock);
  }
  void check_may_arm() const override {
    if (trouble_.open) throw std::runtime_error{"door: the interlock is open"};
  }
  void arm() override {
    if (trouble_.stays_on) throw std::runtime_error{"no answer to enable"};
    device_->arm();
  }
  std::string not_released() const override { return trouble_.not_released; }
  bool measures(std::size_t sensor) const override { return sensor == 0; }
  Actuator* actuator() noexcept override { return device_->actuator(); }
  Sensor& sensor(std::size_t index) noexcept override {
    return index == 0 ? device_->sensor(0) : *this;
  }
  Sample read() noexcept override {
    const bool closed = trouble_.reads_until_open < 0 || trouble_.reads_until_open > 0;
    if (trouble_.reads_until_open > 0) --trouble_.reads_until_open;
    return {.value = closed ? 1.0 : 0.0,
            .time_ns = clock_->time_ns(clock_->now()),
            .fault = closed ? Fault::none : Fault::interlock};
  }

 private:
  Trouble& trouble_;
  std::unique_ptr<Device> device_;
  const Clock* clock_ = nullptr;
};

class TroubledNight : public Night {
 protected:
  // `keys`: of the rig file.
  explicit TroubledNight(const std::string& keys) {
    std::string text = rig_text;
    text.insert(text.find("[plant]"), keys);
    write("axis.toml", text);
  }
  int night() {
    const cli::NightOptions options{.job = path("night.toml"), .voice = cli::Voice::quiet};
    const DriverKit kit{.name = "sim", .summary = "", .configure = [this](const DeviceRequest& to) {
                          return std::make_unique<TroubledDevice>(to, trouble);
                        }};
    return cli::run_night(options, {kit}, time);
  }
  std::string detail(std::size_t sweep) const {
    return summary().at("sweeps").at(sweep).at("detail").get<std::string>();
  }

  Trouble trouble;
  WatchedTime time{1772398800};
};

class NightOfARefusingDrive : public TroubledNight {
 protected:
  NightOfARefusingDrive() : TroubledNight{"[retry]\nfaults = 3\nwait_s = 40\n"} {}
};

TEST_F(NightOfARefusingDrive, TriesAgainAsTheRigFileSays) {
  job("[[night.sweep]]\nrig = \"axis.toml\"\n");
  trouble.refusals = 3;
  EXPECT_EQ(night(), 0);
  EXPECT_EQ(time.pauses, (std::vector<double>{0, 40, 40, 40}));
  EXPECT_EQ(summary().at("sweeps").at(0).at("outcome"), "done");
  EXPECT_EQ(detail(0), "begun at try 4: no connection (Connection refused)");
}

TEST_F(NightOfARefusingDrive, GivesASweepUpWhenItsTriesAreSpent) {
  job("[[night.sweep]]\nrig = \"axis.toml\"\nrepeat = 2\n");
  trouble.refusals = 5;
  EXPECT_EQ(night(), 3);
  EXPECT_EQ(summary().at("sweeps").at(0).at("outcome"), "failed");
  EXPECT_EQ(detail(0),
            "no connection (Connection refused) (3 tries to begin again are spent, [retry])");
  EXPECT_EQ(summary()["sweeps"][1].at("outcome"), "done") << "each has its own";
}

TEST_F(NightOfARefusingDrive, GoesOnWithAnUnfinishedSweepLikewise) {
  job("[[night.sweep]]\nrig = \"axis.toml\"\nset.sensor.y.max = 0.1\n", "on_stop = \"stop\"\n");
  EXPECT_EQ(night(), 3);
  trouble.refusals = 2;
  EXPECT_EQ(night(), 3);
  EXPECT_EQ(record::read_sweep(path("out/axis-1.sweep")).parts.size(), 2U);
  EXPECT_EQ(time.pauses, (std::vector<double>{0, 40, 40}));
}

TEST_F(NightOfARefusingDrive, IsStoppedInTheWait) {
  job("[[night.sweep]]\nrig = \"axis.toml\"\nrepeat = 2\n");
  trouble.refusals = 2;
  time.raised_in_pause = 2;
  EXPECT_EQ(night(), 4);
  EXPECT_EQ(trouble.refusals, 1);
  EXPECT_EQ(summary().at("sweeps").at(0).at("outcome"), "not run");
  EXPECT_EQ(detail(0), "");
}

class NightWithoutRetry : public TroubledNight {
 protected:
  NightWithoutRetry() : TroubledNight{""} {}
};

TEST_F(NightWithoutRetry, TriesOnce) {
  job("[[night.sweep]]\nrig = \"axis.toml\"\n");
  trouble.refusals = 1;
  EXPECT_EQ(night(), 3);
  EXPECT_EQ(trouble.refusals, 0);
  EXPECT_EQ(detail(0), "no connection (Connection refused)");
}

TEST_F(NightWithoutRetry, EndsWhereADriveThatWasNotArmedMayBeOn) {
  job("[[night.sweep]]\nrig = \"axis.toml\"\n"
      "[[night.sweep]]\nname = \"other\"\nrig = \"axis.toml\"\n");
  trouble.stays_on = true;
  trouble.not_released = "the drive may still be on";
  EXPECT_EQ(night(), 3);
  EXPECT_EQ(detail(0), "no answer to enable; the drive may still be on");
  EXPECT_EQ(summary().at("sweeps").at(1).at("outcome"), "not run");
  EXPECT_THAT(detail(1), HasSubstr("a person has to look first, "));
}

// on_stop = "next" all along.
class NightBehindADoor : public TroubledNight {
 protected:
  NightBehindADoor() : TroubledNight{"[sensor.door]\n[retry]\nfaults = 3\n"} {
    job("[[night.sweep]]\nrig = \"axis.toml\"\nrepeat = 2\n"
        "[[night.sweep]]\nname = \"other\"\nrig = \"axis.toml\"\n");
  }
  void expect_rest_not_run(const std::string& why) const {
    for (const std::size_t sweep : {1U, 2U}) {
      EXPECT_EQ(summary().at("sweeps").at(sweep).at("outcome"), "not run");
      EXPECT_EQ(detail(sweep), "a person has to look first, " + why);
    }
  }
};

TEST_F(NightBehindADoor, EndsWhenTheInterlockHasOpenedAndGoesOnWhenItIsCalledAgain) {
  trouble.reads_until_open = 1000;
  EXPECT_EQ(night(), 3);
  EXPECT_EQ(summary().at("sweeps").at(0).at("outcome"), "stopped");
  expect_rest_not_run("axis-1: an interlock has opened");
  trouble.reads_until_open = -1;
  EXPECT_EQ(night(), 0);
  EXPECT_EQ(summary().at("sweeps").at(0).at("parts"), 2);
}

TEST_F(NightBehindADoor, EndsWhereAnActuatorIsNotReleased) {
  trouble.not_released = "the drive has not taken its disarm list";
  EXPECT_EQ(night(), 3);
  EXPECT_EQ(summary().at("sweeps").at(0).at("outcome"), "stopped");
  expect_rest_not_run("axis-1: its actuator has not taken its release");
  trouble.not_released = "";
  EXPECT_EQ(night(), 0);
}

TEST_F(NightBehindADoor, DoesNotKnockWhileTheInterlockIsOpen) {
  trouble.open = true;
  EXPECT_EQ(night(), 3);
  EXPECT_EQ(time.pauses.size(), 1U) << "no try again";
  EXPECT_EQ(summary().at("sweeps").at(0).at("outcome"), "failed");
  expect_rest_not_run("axis-1: door: the interlock is open");
}

TEST_F(Night, IsStoppedByASignalBetweenItsWaitAndTheSweep) {
  job("[[night.sweep]]\nrig = \"axis.toml\"\nrepeat = 2\n");
  WatchedTime time{1772398800};
  time.raised_after_wait = SIGTERM;
  const cli::NightOptions options{.job = path("night.toml"), .voice = cli::Voice::quiet};
  EXPECT_EQ(cli::run_night(options, {sim::sim_driver()}, time), 4);
  EXPECT_EQ(time.pauses.size(), 1U);
  EXPECT_FALSE(fs::exists(path("out/axis-1.sweep"))) << "nothing has moved";
}

// Told to stop while it is opened.
class StoppedDevice final : public Device {
 public:
  void open(const Clock& /*clock*/) override {
    std::raise(SIGTERM);
    waiting().go_on();
  }
  Actuator* actuator() noexcept override { return nullptr; }
  Sensor& sensor(std::size_t /*index*/) noexcept override { std::abort(); }
};

TEST_F(Night, IsStoppedByASignalBeforeASweepHasAFile) {
  write("bare.toml",
        "[loop]\nrate_hz = 500\n[sweep]\nstart_hz = 1\nstop_hz = 50\npoints = 5\n"
        "amplitude = 0.5\n[limits]\n[actuator]\n[sensor.y]\n");
  job("[[night.sweep]]\nrig = \"bare.toml\"\nrepeat = 2\n");
  const DriverKit kit{.name = "sim", .summary = "", .configure = [](const DeviceRequest&) {
                        return std::make_unique<StoppedDevice>();
                      }};
  cli::PassingTime time{1772398800};
  const cli::NightOptions options{.job = path("night.toml"), .voice = cli::Voice::quiet};
  EXPECT_EQ(cli::run_night(options, {kit}, time), 4);
  EXPECT_FALSE(fs::exists(path("out/bare-1.sweep")));
  const auto json = summary();
  for (const auto& sweep : json.at("sweeps")) EXPECT_EQ(sweep.at("outcome"), "not run");
}

TEST_F(Night, IsDoneWhereASignalComesAfterItsLastSweep) {
  job("[[night.sweep]]\nrig = \"axis.toml\"\nrepeat = 2\n");
  for (const int code : {4, 0}) {
    WatchedTime time{1772398800};
    time.raised_after_sweep = SIGTERM;
    const cli::NightOptions options{.job = path("night.toml"), .voice = cli::Voice::quiet};
    EXPECT_EQ(cli::run_night(options, {sim::sim_driver()}, time), code);
  }
  EXPECT_EQ(record::read_sweep(path("out/axis-2.sweep")).fact("outcome"), "done");
}

// It may be all that is left of a night.
TEST_F(Night, AFileThatCannotBeReadIsLeftAlone) {
  job("[[night.sweep]]\nrig = \"axis.toml\"\n");
  ASSERT_EQ(run({"night", "night.toml"}).code, 0);
  record::Database{path("out/axis-1.sweep"), record::Database::Mode::write}.execute(
      "PRAGMA user_version = 99");
  for (const bool no_database : {false, true}) {
    if (no_database) write("out/axis-1.sweep", std::string(5000, 'x'));
    const std::string before = read("out/axis-1.sweep");
    const auto again = run({"night", "night.toml"});
    EXPECT_EQ(again.code, 1);
    EXPECT_THAT(again.err, HasSubstr(no_database ? "out/axis-1.sweep: not a sweep file, or damaged"
                                                 : "out/axis-1.sweep: was written by a newer "
                                                   "sinerig"));
    EXPECT_EQ(read("out/axis-1.sweep"), before);
  }
}

TEST_F(Night, AFileInWhichNothingHasBegunIsBegunAnew) {
  job("[[night.sweep]]\nrig = \"axis.toml\"\nrepeat = 2\n");
  fs::create_directories(path("out"));
  write("out/axis-1.sweep", "");
  record::Database{path("out/axis-2.sweep"), record::Database::Mode::create}.execute(
      "PRAGMA journal_mode = WAL");
  const auto ran = run({"night", "night.toml"});
  EXPECT_EQ(ran.code, 0) << ran.err;
  for (const char* name : {"out/axis-1.sweep", "out/axis-2.sweep"}) {
    EXPECT_EQ(record::read_sweep(path(name)).fact("outcome"), "done") << name;
    EXPECT_FALSE(fs::exists(path(name) + "-old"));
  }
}

// One that breaks meanwhile costs the night that sweep, not the others, nor the summary.
TEST_F(Night, AFileThatBreaksMeanwhileIsARowOfTheSummary) {
  job("[[night.sweep]]\nrig = \"axis.toml\"\nrepeat = 2\n");
  class BreakingTime final : public cli::WallTime {
   public:
    explicit BreakingTime(std::string file) : file_{std::move(file)} {}
    std::int64_t now_s() override { return 1772398800; }
    double elapsed_s() override { return 0.0; }
    bool wait_until(std::int64_t, const std::atomic<int>&, const Meanwhile&) override {
      return true;
    }
    bool wait_for(double, const std::atomic<int>&, const Meanwhile&) override { return true; }
    void pass(double) override {
      if (!fs::exists(file_)) std::ofstream{file_} << std::string(5000, 'x');
    }

   private:
    std::string file_;
  } time{path("out/axis-2.sweep")};
  const cli::NightOptions options{.job = path("night.toml"), .voice = cli::Voice::quiet};
  EXPECT_EQ(cli::run_night(options, {sim::sim_driver()}, time), 3);
  EXPECT_EQ(summary().at("sweeps").at(0).at("outcome"), "done");
  EXPECT_EQ(summary().at("sweeps").at(1).at("outcome"), "failed");
  EXPECT_THAT(summary()["sweeps"][1].at("detail").get<std::string>(), HasSubstr("axis-2.sweep"));
  EXPECT_EQ(read("out/axis-2.sweep"), std::string(5000, 'x'));
}

TEST_F(Night, ThatBeganYesterdayDoesNotWaitForTomorrow) {
  job("[[night.sweep]]\nrig = \"axis.toml\"\nstart_after_s = 3600\n");
  fs::create_directories(path("out"));
  write("out/night.json", "{\"format\": \"sinerig-night\", \"began_s\": 1772398800}");
  WatchedTime time{1772398800 + 20000};  // the machine was off meanwhile
  const cli::NightOptions options{.job = path("night.toml"), .voice = cli::Voice::quiet};
  EXPECT_EQ(cli::run_night(options, {sim::sim_driver()}, time), 0);
  EXPECT_EQ(time.pauses, (std::vector<double>{0}));
  EXPECT_THAT(time.waits, testing::IsEmpty());
}

TEST_F(Night, ASweepStoppedByALimitIsFollowedByTheNextOrNot) {
  const std::string sweeps =
      "[[night.sweep]]\nname = \"narrow\"\nrig = \"axis.toml\"\nset.sensor.y.max = 0.1\n"
      "[[night.sweep]]\nrig = \"axis.toml\"\n";
  job(sweeps);
  EXPECT_EQ(run({"night", "night.toml"}).code, 3);
  EXPECT_EQ(summary().at("sweeps").at(0).at("outcome"), "stopped");
  EXPECT_THAT(summary()["sweeps"][0].at("detail").get<std::string>(), HasSubstr("limit 0.1"));
  EXPECT_EQ(summary()["sweeps"][1].at("outcome"), "done");
  EXPECT_EQ(run({"night", "night.toml"}).code, 3);
  EXPECT_EQ(record::read_sweep(path("out/narrow-1.sweep")).parts.size(), 1U) << "it had its chance";

  fs::remove_all(path("out"));
  job(sweeps, "on_stop = \"stop\"\n");
  EXPECT_EQ(run({"night", "night.toml"}).code, 3);
  EXPECT_EQ(summary().at("sweeps").at(1).at("outcome"), "not run");
  EXPECT_EQ(run({"night", "night.toml"}).code, 3);
  EXPECT_EQ(record::read_sweep(path("out/narrow-1.sweep")).parts.size(), 2U) << "tried again";
}

TEST_F(Night, ARigThatChangedMeanwhileIsRefused) {
  job("[[night.sweep]]\nrig = \"axis.toml\"\n");
  ASSERT_EQ(run({"night", "night.toml"}).code, 0);
  write("axis.toml", std::string{rig_text} + "# edited\n");
  const auto again = run({"night", "night.toml"});
  EXPECT_EQ(again.code, 2);
  EXPECT_THAT(again.err, HasSubstr("out/axis-1.sweep: was made from another rig file or other "
                                   "values than axis.toml now gives"));
}

TEST_F(Night, ChangesBetweenRepeatsAreExitCodeFive) {
  job("[[night.sweep]]\nrig = \"axis.toml\"\nrepeat = 2\n");
  // The second repeat as a rig would have measured it whose gain has risen by a fifth.
  std::string other = rig_text;
  other.replace(other.find("num = [60]"), 10, "num = [72]\nseed = 2");
  write("other.toml", other);
  fs::create_directories(path("out"));
  ASSERT_EQ(run({"run", "other.toml", "-o", "out/axis-2.sweep"}).code, 0);
  std::string as_if = rig_text;
  as_if.insert(as_if.find("[plant]\n") + 8, "seed = 2\n");
  {
    record::Database database{path("out/axis-2.sweep"), record::Database::Mode::write};
    record::Statement text{database, "UPDATE run SET value = ? WHERE key = 'rig_text'"};
    text.bind(as_if).run();
  }
  const auto ran = run({"night", "night.toml"});
  EXPECT_EQ(ran.code, 5) << ran.err;
  EXPECT_THAT(ran.out, HasSubstr("axis-2 y: 5 of 5 points changed; most at "));
  EXPECT_EQ(summary().at("changed"), true);
}

// The shipped job is the reference of every key; a key in a comment stands at its default.
TEST_F(Night, TheShippedJobExplainsEveryKey) {
  const std::string config = std::string{SINERIG_SOURCE_DIR} + "/config/";
  std::ifstream stream{config + "night.toml"};
  std::string text{std::istreambuf_iterator<char>{stream}, {}};
  for (const char* key : {"folder", "on_stop", "tolerance_db", "tolerance_deg", "false_alarm",
                          "rig", "name", "repeat", "pause_s", "start_at", "start_after_s"}) {
    EXPECT_THAT(text, testing::ContainsRegex("\n(# )?" + std::string{key} + " = ")) << key;
  }
  for (std::size_t at = 0; (at = text.find("\n# ", at)) != std::string::npos; ++at) {
    const std::string line = text.substr(at + 3, text.find('\n', at + 1) - at - 3);
    if (line.find(" = ") != std::string::npos) text.erase(at + 1, 2);
  }
  for (std::size_t at = 0; (at = text.find("\"gimbal.toml\"", at)) != std::string::npos; ++at) {
    text.replace(at, 13, "\"" + config + "gimbal.toml\"");
  }
  write("shipped.toml", text);
  const cli::NightJob job = cli::read_night_job(path("shipped.toml"));
  EXPECT_EQ(job.folder, path("night"));
  ASSERT_EQ(job.sweeps.size(), 2U);
  EXPECT_EQ(job.sweeps[0].second_of_day, 22 * 3600 + 1800);
  EXPECT_EQ(cli::tasks_of(job).size(), 4U);
}

TEST_F(Night, RefusesABadJobBeforeAnythingMoves) {
  const auto refusal = [&](const std::string& sweeps, const std::string& keys = "") {
    job(sweeps, keys);
    const auto ran = run({"night", "night.toml"});
    EXPECT_EQ(ran.code, 2);
    EXPECT_FALSE(fs::exists(path("out")));
    return ran.err;
  };
  const std::string sweep = "[[night.sweep]]\nrig = \"axis.toml\"\n";
  EXPECT_THAT(refusal(""), HasSubstr("[night] sweep: is missing; add a section [[night.sweep]]"));
  EXPECT_THAT(refusal(sweep, "on_stop = \"wait\"\n"),
              HasSubstr("must be one of \"next\" \"stop\""));
  EXPECT_THAT(refusal(sweep + "start_at = \"25:00\"\n"),
              HasSubstr("start_at = '25:00': must be a local time of day, \"22:30\""));
  EXPECT_THAT(refusal(sweep + "repeats = 2\n"), HasSubstr("unknown key; did you mean repeat?"));
  EXPECT_THAT(refusal(sweep + sweep), HasSubstr("\"axis\" is the name of an earlier sweep"));
  EXPECT_THAT(refusal(sweep + "name = \"a/b\"\n"), HasSubstr("must be letters, digits, _ and -"));
  EXPECT_THAT(refusal(sweep + "set.sweep.amplitud = 1\n"),
              HasSubstr("error: night.toml:5: [sweep] amplitud: unknown key; did you mean "
                        "amplitude? (set for axis.toml)"));
  EXPECT_THAT(refusal(sweep + "repeat = 2\nset.sweep.amplitude = -3\n"),
              HasSubstr("error: night.toml:6: [sweep] amplitude = -3: must be above 0"));
  EXPECT_THAT(refusal(sweep + "set.sweeep.amplitude = 3\n"),
              HasSubstr("error: night.toml:5: [sweeep]: unknown section; did you mean sweep?"));
  EXPECT_THAT(refusal("[[night.sweep]]\nrig = \"none.toml\"\n"),
              HasSubstr("night.toml:4: [night.sweep] rig: none.toml: cannot be read"));
  EXPECT_THAT(
      refusal(sweep + "set.loop.clock = \"monotonic\"\n"
                      "set.loop.cpu = 1023\nset.loop.require_realtime = true\n"),
      testing::AllOf(HasSubstr("night.toml:7: [loop] require_realtime = true: this machine "
                               "does not grant:"),
                     HasSubstr("cpu: CPU 1023 was refused"), HasSubstr("(set for axis.toml)")));
  EXPECT_THAT(refusal(sweep + "pause_s = 1\nset.limits.command_max = 0.1\n"),
              HasSubstr("axis.toml:7: [sweep] amplitude = 0.5"));
}

}  // namespace
}  // namespace sinerig
