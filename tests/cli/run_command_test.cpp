// What becomes of the actuator when a run fails outside of the loop.
#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <stdexcept>
#include <thread>
#include <unistd.h>

#include <gmock/gmock.h>
#include <sys/resource.h>

#include "cli/commands.h"
#include "cli/configured_rig.h"
#include "record/sweep_reader.h"
#include "support/fake_rig.h"

namespace sinerig::cli {
namespace {

namespace fs = std::filesystem;

struct Witness {
  double last = 99.0;
  int releases = 0;
  std::int64_t parts_when_caught_up = -1;  // in the sweep file, when the device was told last
  std::size_t writes = 0;
  // What happens while the device waits for its drive.
  std::function<void(const Waiting&)> opening{};
  std::function<void(const Waiting&)> arming{};
  std::function<void(const Waiting&)> arming_again{};
  std::optional<std::uint64_t> faulty_tick{};
  std::string not_released{};
  std::string says{};  // of its faults
};

// Moves its output on opening, and lets go of it at its end.
class FakeDevice final : public Device {
 public:
  FakeDevice(Witness& witness, fs::path file) : witness_{witness}, file_{std::move(file)} {}
  ~FakeDevice() override {
    if (actuator_) actuator_->release();
    note();
  }
  void open(const Clock& clock) override {
    actuator_.emplace(clock);
    actuator_->write(0.3);
    sensor_.emplace(clock, [this](std::uint64_t) { return actuator_->last; });
    actuator_->fault_at = [this](std::uint64_t tick) {
      const bool faulty = witness_.faulty_tick == tick;
      if (faulty) witness_.faulty_tick.reset();
      return faulty ? Fault::device : Fault::none;
    };
    note();
    if (witness_.opening) witness_.opening(waiting());
  }
  void arm() override {
    if (witness_.arming) witness_.arming(waiting());
  }
  void rearm() override {
    actuator_->released = false;
    if (witness_.arming_again) witness_.arming_again(waiting());
  }
  void catch_up() override {
    record::Database database{file_, record::Database::Mode::read};
    record::Statement parts{database, "SELECT count(*) FROM part"};
    parts.step();
    witness_.parts_when_caught_up = parts.integer(0);
  }
  std::string not_released() const override { return witness_.not_released; }
  std::string fault_reason() const override { return witness_.says; }
  Actuator* actuator() noexcept override { return &*actuator_; }
  Sensor& sensor(std::size_t) noexcept override { return *sensor_; }

 private:
  void note() {
    if (!actuator_) return;
    witness_.last = actuator_->last;
    witness_.releases = actuator_->releases;
    witness_.writes = actuator_->writes.size();
  }
  Witness& witness_;
  fs::path file_;
  std::optional<test::FakeActuator> actuator_;
  std::optional<test::FakeSensor> sensor_;
};

class BrokenDevice final : public Device {
 public:
  void open(const Clock&) override { throw std::runtime_error("the bus is not there"); }
  std::string fault_reason() const override { return "edges were lost"; }
  Actuator* actuator() noexcept override { return nullptr; }
  Sensor& sensor(std::size_t) noexcept override { std::abort(); }
};

class RunCommand : public testing::Test {
 protected:
  RunCommand() {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~RunCommand() override { fs::remove_all(folder_); }

  std::string rig(const std::string& second_sensor, int points = 300) const {
    const std::string path = folder_ / "rig.toml";
    std::ofstream{path} << "[loop]\nrate_hz = 2000\n[sweep]\nstart_hz = 20\nstop_hz = 200\n"
                           "amplitude = 0.2\nfrequency_tolerance = 1e-6\npoints = "
                        << points
                        << "\n"
                           "[limits]\n[actuator]\n[sensor.y]\n"
                        << second_sensor << "[output]\nsamples = true\n";
    return path;
  }
  RunOptions options(const std::string& rig_path) const {
    return {.rig = rig_path, .output = folder_ / "run.sweep"};
  }
  DriverKit fake(Witness& witness) const {
    return {.name = "sim", .summary = "", .configure = [&witness, this](const DeviceRequest&) {
              return std::make_unique<FakeDevice>(witness, folder_ / "run.sweep");
            }};
  }

  fs::path folder_ =
      fs::path{testing::TempDir()} / testing::UnitTest::GetInstance()->current_test_info()->name();
};

TEST_F(RunCommand, ReleasesTheActuatorWhenAnotherDriverCannotBeOpened) {
  Witness witness;
  const DriverKit broken{.name = "broken", .summary = "", .configure = [](const DeviceRequest&) {
                           return std::make_unique<BrokenDevice>();
                         }};
  const std::string path = rig("[sensor.z]\ndriver = \"broken\"\n");
  EXPECT_THROW(run_command(options(path), {fake(witness), broken}), std::runtime_error);
  EXPECT_EQ(witness.last, 0.0);
  EXPECT_GE(witness.releases, 1);
  EXPECT_FALSE(fs::exists(folder_ / "run.sweep"));
}

TEST_F(RunCommand, AsksTheDeviceOfTheChannelThatHasTrippedWhy) {
  Witness witness;
  witness.says = "no answer in time";
  const DriverKit broken{.name = "broken", .summary = "", .configure = [](const DeviceRequest&) {
                           return std::make_unique<BrokenDevice>();
                         }};
  const ConfiguredRig two{rig("[sensor.z]\ndriver = \"broken\"\n"), {fake(witness), broken}};
  EXPECT_EQ(two.fault_reason({.cause = TripCause::actuator_fault}), "no answer in time");
  EXPECT_EQ(two.fault_reason({.cause = TripCause::channel_age, .channel = 0}), "no answer in time");
  EXPECT_EQ(two.fault_reason({.cause = TripCause::channel_age, .channel = 1}), "edges were lost");
}

// That commit may take a disk a while.
TEST_F(RunCommand, TellsTheDevicesToCatchUpOnceItsPartIsInTheFile) {
  Witness witness;
  EXPECT_EQ(run_command(options(rig("", 2)), {fake(witness)}), exit_done);
  EXPECT_EQ(witness.parts_when_caught_up, 1);
}

// All points are measured, and nobody may take the drive for harmless.
TEST_F(RunCommand, SaysThatTheActuatorHasNotTakenItsRelease) {
  Witness witness;
  witness.not_released = "the drive has not taken neutral and may still be on: line: no answer";
  EXPECT_EQ(run_command(options(rig("", 2)), {fake(witness)}), exit_stopped);
  const record::StoredRun run = record::read_sweep(folder_ / "run.sweep");
  EXPECT_EQ(run.fact("outcome"), "stopped");
  EXPECT_EQ(run.fact("outcome_detail"), witness.not_released);
  EXPECT_TRUE(std::none_of(run.events.begin(), run.events.end(),
                           [](const auto& event) { return event.kind == "released"; }));
  const auto told = std::find_if(run.events.begin(), run.events.end(),
                                 [](const auto& event) { return event.kind == "not_released"; });
  ASSERT_NE(told, run.events.end());
  EXPECT_EQ(told->detail, witness.not_released);
}

TEST_F(RunCommand, ReleasesTheActuatorWhenTheDiskIsFull) {
  Witness witness;
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  rlimit limit = before;
  limit.rlim_cur = 300'000;
  setrlimit(RLIMIT_FSIZE, &limit);
  const int code = run_command(options(rig("")), {fake(witness)});
  setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_EQ(code, exit_stopped);
  const record::StoredRun run = record::read_sweep(folder_ / "run.sweep");
  EXPECT_TRUE(std::any_of(run.events.begin(), run.events.end(),
                          [](const auto& event) { return event.kind == "released"; }));
  EXPECT_EQ(witness.last, 0.0);
  EXPECT_GE(witness.releases, 1);
}

// Homes for a minute, say, and is asked to stop meanwhile; or as the last step is taken. The loop's
// thread leaves the signal to another.
void be_stopped_waiting(const Waiting& waiting) {
  kill(getpid(), SIGINT);
  if (!waiting.pause_for(3'600'000'000'000)) throw StopRequested{};
}
void be_stopped_at_the_end(const Waiting& waiting) {
  kill(getpid(), SIGINT);
  while (waiting.may_go_on()) std::this_thread::yield();
}
void be_stopped_failing(const Waiting& waiting) {
  be_stopped_at_the_end(waiting);
  throw std::runtime_error{"connect: Interrupted system call"};
}

TEST_F(RunCommand, IsStoppedWhileADeviceIsOpenedOrArmed) {
  std::signal(SIGINT, SIG_DFL);
  for (const auto stopped : {be_stopped_waiting, be_stopped_at_the_end, be_stopped_failing}) {
    for (const bool opening : {true, false}) {
      Witness witness;
      (opening ? witness.opening : witness.arming) = stopped;
      EXPECT_EQ(run_command(options(rig("")), {fake(witness)}), exit_interrupted);
      EXPECT_EQ(witness.last, 0.0);
      EXPECT_EQ(witness.writes, 1U) << "by open()";
      EXPECT_GE(witness.releases, opening ? 1 : 2) << "before it is closed, too";
      EXPECT_FALSE(fs::exists(folder_ / "run.sweep"));
    }
  }
}

TEST_F(RunCommand, IsStoppedWhileADeviceIsArmedAgain) {
  std::signal(SIGINT, SIG_DFL);
  for (const auto stopped : {be_stopped_waiting, be_stopped_at_the_end, be_stopped_failing}) {
    Witness witness;
    witness.faulty_tick = 500;
    witness.arming_again = stopped;
    RunOptions again = options(rig("[retry]\nfaults = 5\nwait_s = 0.01\n"));
    again.force = true;
    EXPECT_EQ(run_command(again, {fake(witness)}), exit_interrupted);
    EXPECT_EQ(witness.last, 0.0);
    EXPECT_EQ(witness.writes, 503U) << "by open(), up to the fault, and neutral behind it";
    const record::StoredRun run = record::read_sweep(folder_ / "run.sweep");
    EXPECT_EQ(run.fact("outcome"), "interrupted");
    EXPECT_THAT(run.fact("outcome_detail"), testing::Not(testing::HasSubstr("[retry]")));
  }
}

}  // namespace
}  // namespace sinerig::cli
