// What `check` says of sensors that a device of this process has.
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <unistd.h>
#include <utility>
#include <vector>

#include <gmock/gmock.h>

#include "cli/channel_check.h"
#include "cli/commands.h"
#include "drivers/device.h"
#include "support/fake_rig.h"

namespace sinerig::cli {
namespace {

using testing::HasSubstr;
using testing::Not;

class Nothing final : public Actuator {
 public:
  Sample write(double command) noexcept override { return {.value = command}; }
  void release() noexcept override {}
};

// Has nothing new: nobody commands.
class Silent final : public Sensor {
 public:
  explicit Silent(Fault fault) : fault_{fault} {}
  Sample read() noexcept override { return {.value = 0.0, .time_ns = 0, .fault = fault_}; }

 private:
  Fault fault_;
};

class SilentDevice final : public Device {
 public:
  SilentDevice(bool answers, Fault fault, std::function<void()> opening)
      : answers_{answers}, sensor_{fault}, opening_{std::move(opening)} {}
  void open(const Clock& /*clock*/) override {
    if (!opening_) return;
    opening_();
    waiting().go_on();
  }
  bool answers_command(std::size_t /*sensor*/) const override { return answers_; }
  Actuator* actuator() noexcept override { return &actuator_; }
  Sensor& sensor(std::size_t /*index*/) noexcept override { return sensor_; }

 private:
  bool answers_;
  Nothing actuator_;
  Silent sensor_;
  std::function<void()> opening_;
};

struct Checked {
  int code = 0;
  std::string said;
};

Checked check(bool answers, Fault fault = Fault::stale, std::function<void()> opening = {}) {
  const std::string rig = (std::filesystem::temp_directory_path() /
                           ("sinerig-check-test-" + std::to_string(getpid()) + ".toml"))
                              .string();
  std::ofstream{rig} << "[loop]\nrate_hz = 500\n[sweep]\nstart_hz = 5\nstop_hz = 20\npoints = 5\n"
                        "amplitude = 0.5\n[limits]\nage_s = 0.05\n[actuator]\n[sensor.y]\n";
  const DriverKit kit{.name = "sim", .summary = "", .configure = [&](const DeviceRequest&) {
                        return std::make_unique<SilentDevice>(answers, fault, opening);
                      }};
  testing::internal::CaptureStdout();
  const int code = check_command({.rig = rig, .seconds = 0.5}, {kit});
  std::filesystem::remove(rig);
  return {code, testing::internal::GetCapturedStdout()};
}

TEST(CheckCommand, ASensorThatAnswersSetPointsOnlyIsSilentAndFit) {
  const Checked answering = check(true);
  EXPECT_EQ(answering.code, exit_done) << answering.said;
  EXPECT_THAT(answering.said, HasSubstr("answers set-points only\n"));
  EXPECT_THAT(answering.said, HasSubstr("nothing was found that would stop a sweep"));

  const Checked reporting = check(false);
  EXPECT_EQ(reporting.code, exit_stopped);
  EXPECT_THAT(reporting.said, Not(HasSubstr("answers set-points only")));
}

TEST(CheckCommand, CountsEveryFaultThereIs) {
  EXPECT_THAT(check(false, Fault::device).said,
              HasSubstr("250 of 250 readings had the fault \"device\""));
}

TEST(CheckCommand, IsInterruptedWhileADeviceIsOpened) {
  std::signal(SIGHUP, SIG_DFL);
  const Checked stopped = check(true, Fault::stale, [] { std::raise(SIGHUP); });
  EXPECT_EQ(stopped.code, exit_interrupted);
}

TEST(AThinnedSeries, KeepsToItsRoomAndIsSpreadEvenly) {
  ThinnedSeries series{1000};
  for (std::int64_t i = 0; i < 1'000'000; ++i) series.add(i);
  EXPECT_EQ(series.count(), 1'000'000U);
  EXPECT_EQ(series.most(), 999'999);
  const std::vector<std::int64_t>& values = series.values();
  EXPECT_GT(values.size(), 500U);
  EXPECT_LE(values.size(), 1000U);
  for (std::size_t i = 0; i < values.size(); ++i)
    EXPECT_EQ(values[i], 1024 * static_cast<std::int64_t>(i));
}

TEST(DistancesBetweenSamples, TellHowManyAreMissing) {
  DistanceCounts counts;
  for (int i = 0; i < 10'000; ++i) counts.add(1'000'000 + 37 * (i % 300));
  for (int i = 0; i < 5; ++i) counts.add(2'000'000);
  counts.add(4'010'000);
  counts.add(0);
  EXPECT_EQ(counts.missing(1'000'000.0), 5U + 3U);
}

// Aged by 2 ms and, every tenth, by 5 ms; of a hundred one is lost.
TEST(CheckOfASensor, TellsRateAgeJitterAndLosses) {
  test::ScriptedClock clock{1000.0};
  class Aged final : public Sensor {
   public:
    explicit Aged(const Clock& clock) : clock_{clock} {}
    Sample read() noexcept override {
      const std::uint64_t tick = clock_.now().tick;
      const std::int64_t age_ns = tick % 10 == 5 ? 5'000'000 : 2'000'000;
      return {.value = static_cast<double>(tick),
              .time_ns = clock_.time_ns(clock_.now()) - age_ns,
              .fault = tick % 100 == 99 ? Fault::timeout : Fault::none};
    }

   private:
    const Clock& clock_;
  };
  Aged sensor{clock};
  Sensor* const sensors[] = {&sensor};
  GuardSettings guard;
  guard.channels.resize(1);
  ChannelCheckRun run{clock, sensors, guard};
  const RunControl control;
  run.read(1.0, control);
  const RigCheck check = run.evaluate();
  EXPECT_EQ(check.loop.ticks, 1000U);
  const ChannelCheck& channel = check.channels.at(0);
  EXPECT_EQ(channel.samples, 990U);
  EXPECT_EQ(channel.faulty(Fault::timeout), 10U);
  EXPECT_DOUBLE_EQ(channel.age_median_s, 2e-3);
  EXPECT_DOUBLE_EQ(channel.age_99_s, 5e-3);
  EXPECT_DOUBLE_EQ(channel.age_most_s, 5e-3);
  EXPECT_NEAR(channel.rate_hz, 989.0 / 0.998, 1e-6);
  // A late one is followed by the next after 4 ms, which looks like three that are missing.
  EXPECT_EQ(channel.lost, 9U + 100U * 3U);
}

}  // namespace
}  // namespace sinerig::cli
