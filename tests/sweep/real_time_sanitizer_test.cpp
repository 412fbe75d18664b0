// The gate is tested too: a sensor that misbehaves inside the loop must make the real-time
// sanitizer end the process and name the call. Built under the preset `rtsan` only.
#include <fstream>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "support/collecting_sink.h"
#include "support/virtual_run.h"

namespace sinerig {
namespace {

class MisbehavingSensor final : public Sensor {
 public:
  explicit MisbehavingSensor(std::function<void()> deed) : deed_{std::move(deed)} {}
  Sample read() noexcept override {
    deed_();
    return {.value = 1.0};
  }

 private:
  std::function<void()> deed_;
};

class PassingActuator final : public Actuator {
 public:
  Sample write(double command) noexcept override { return {.value = command}; }
  void release() noexcept override {}
};

void sweep_reading(const std::function<void()>& deed) {
  SweepSettings sweep;
  sweep.start_hz = 10.0;
  sweep.stop_hz = 100.0;
  sweep.points = 2;
  sweep.amplitude = 1.0;
  VirtualClock clock{TickGrid{1000.0}};
  PassingActuator actuator;
  MisbehavingSensor sensor{deed};
  const std::vector<Sensor*> sensors{&sensor};
  Guard guard{test::open_guard(1), clock.grid().period_s()};
  test::CollectingSink sink;
  SweepRunner runner{plan_sweep(sweep, {}, 1000.0), {}, clock, actuator, sensors, guard, sink};
  RunControl control;
  runner.run(control);
}

TEST(RealTimeSanitizer, LetsABehavedSensorPass) {
  int reads = 0;
  sweep_reading([&reads] { ++reads; });
  EXPECT_GT(reads, 100);
}

TEST(RealTimeSanitizerDeathTest, CatchesAnAllocation) {
  std::unique_ptr<double> kept;
  EXPECT_DEATH(sweep_reading([&kept] { kept = std::make_unique<double>(1.0); }),
               "RealtimeSanitizer: unsafe-library-call.*\n.*`malloc`");
}

TEST(RealTimeSanitizerDeathTest, CatchesALock) {
  std::mutex mutex;
  EXPECT_DEATH(sweep_reading([&mutex] { const std::scoped_lock lock{mutex}; }),
               "RealtimeSanitizer: unsafe-library-call.*\n.*`pthread_mutex_lock`");
}

TEST(RealTimeSanitizerDeathTest, CatchesAWriteToAFile) {
  std::ofstream file{"/dev/null"};
  EXPECT_DEATH(sweep_reading([&file] { file << 1 << std::flush; }),
               "RealtimeSanitizer: unsafe-library-call.*\n.*`writev?`");
}

}  // namespace
}  // namespace sinerig
