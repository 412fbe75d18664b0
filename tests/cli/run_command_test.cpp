// What becomes of the actuator when a run fails outside of the loop.
#include <csignal>
#include <filesystem>
#include <fstream>
#include <optional>
#include <stdexcept>

#include <gmock/gmock.h>
#include <sys/resource.h>

#include "cli/commands.h"
#include "record/database.h"
#include "support/fake_rig.h"

namespace sinerig::cli {
namespace {

namespace fs = std::filesystem;

struct Witness {
  double last = 99.0;
  int releases = 0;
  std::int64_t parts_when_caught_up = -1;  // in the sweep file, when the device was told last
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
    note();
  }
  void catch_up() override {
    record::Database database{file_, record::Database::Mode::read};
    record::Statement parts{database, "SELECT count(*) FROM part"};
    parts.step();
    witness_.parts_when_caught_up = parts.integer(0);
  }
  Actuator* actuator() noexcept override { return &*actuator_; }
  Sensor& sensor(std::size_t) noexcept override { return *sensor_; }

 private:
  void note() {
    if (!actuator_) return;
    witness_.last = actuator_->last;
    witness_.releases = actuator_->releases;
  }
  Witness& witness_;
  fs::path file_;
  std::optional<test::FakeActuator> actuator_;
  std::optional<test::FakeSensor> sensor_;
};

class BrokenDevice final : public Device {
 public:
  void open(const Clock&) override { throw std::runtime_error("the bus is not there"); }
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

// That commit may take a disk a while.
TEST_F(RunCommand, TellsTheDevicesToCatchUpOnceItsPartIsInTheFile) {
  Witness witness;
  EXPECT_EQ(run_command(options(rig("", 2)), {fake(witness)}), exit_done);
  EXPECT_EQ(witness.parts_when_caught_up, 1);
}

TEST_F(RunCommand, ReleasesTheActuatorWhenTheDiskIsFull) {
  Witness witness;
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  rlimit limit = before;
  limit.rlim_cur = 300'000;
  setrlimit(RLIMIT_FSIZE, &limit);
  EXPECT_EQ(run_command(options(rig("")), {fake(witness)}), exit_stopped);
  setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_EQ(witness.last, 0.0);
  EXPECT_GE(witness.releases, 1);
}

}  // namespace
}  // namespace sinerig::cli
