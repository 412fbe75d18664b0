// What `check` says of sensors that a device of this process has.
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <unistd.h>

#include <gmock/gmock.h>

#include "cli/channel_check.h"
#include "cli/commands.h"
#include "drivers/device.h"

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
  SilentDevice(bool answers, Fault fault) : answers_{answers}, sensor_{fault} {}
  void open(const Clock& /*clock*/) override {}
  bool answers_command(std::size_t /*sensor*/) const override { return answers_; }
  Actuator* actuator() noexcept override { return &actuator_; }
  Sensor& sensor(std::size_t /*index*/) noexcept override { return sensor_; }

 private:
  bool answers_;
  Nothing actuator_;
  Silent sensor_;
};

struct Checked {
  int code = 0;
  std::string said;
};

Checked check(bool answers, Fault fault = Fault::stale) {
  const std::string rig = (std::filesystem::temp_directory_path() /
                           ("sinerig-check-test-" + std::to_string(getpid()) + ".toml"))
                              .string();
  std::ofstream{rig} << "[loop]\nrate_hz = 500\n[sweep]\nstart_hz = 5\nstop_hz = 20\npoints = 5\n"
                        "amplitude = 0.5\n[limits]\nage_s = 0.05\n[actuator]\n[sensor.y]\n";
  const DriverKit kit{.name = "sim", .summary = "", .configure = [&](const DeviceRequest&) {
                        return std::make_unique<SilentDevice>(answers, fault);
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

}  // namespace
}  // namespace sinerig::cli
