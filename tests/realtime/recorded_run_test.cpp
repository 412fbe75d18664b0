// The loop on its thread, the recorder on another, the queue between them: what is in the file is
// what the loop measured. Under the preset `tsan` the thread sanitizer watches.
#include <complex>
#include <filesystem>
#include <numbers>

#include <gtest/gtest.h>

#include "realtime/loop_thread.h"
#include "record/recorder.h"
#include "record/sweep_reader.h"
#include "support/virtual_run.h"
#include "sweep/outbox.h"

namespace sinerig {
namespace {

namespace fs = std::filesystem;

SweepPlan short_plan() {
  SweepSettings sweep;
  sweep.spacing = Spacing::list;
  sweep.frequencies_hz = {50.0, 80.0, 100.0};
  sweep.amplitude = 0.5;
  sweep.settling = Settling::fixed;
  sweep.target_db = sweep.target_deg = 0.0;
  sweep.settle = {.cycles = 2.0, .seconds = 0.02};
  sweep.integrate = {.cycles = 4.0, .seconds = 0.05};
  return plan_sweep(sweep, {}, 1000.0);
}

sim::SimulatedRigSettings axis() {
  sim::SimulatedRigSettings settings;
  settings.system = sim::from_transfer_function({10.0}, {1.0, 10.0});
  settings.sensors = {{.output = 0, .imperfections = {.noise_rms = 1e-3}}};
  return settings;
}

RunnerSettings usual_settings() {
  return {.responses = {}, .readbacks = {}, .record_samples = true, .max_gap_s = 60.0};
}

record::StoredRun record_run(realtime::LoopThread& thread, Clock& clock, Outbox::WhenFull when_full,
                             std::size_t capacity, const SweepPlan& plan = short_plan(),
                             const RunnerSettings& settings = usual_settings()) {
  const fs::path path =
      fs::path{testing::TempDir()} /
      (std::string{testing::UnitTest::GetInstance()->current_test_info()->name()} + ".sweep");
  fs::remove(path);
  {
    record::RunInfo info{
        .rig_name = "rig.toml", .rig_text = "", .clock = "", .channels = {}, .plan = plan};
    info.channels = {{"command", "1"}, {"applied", "1"}, {"y", "1"}};
    record::SweepWriter writer{path, info, record::SweepWriter::IfExists::refuse};
    sim::SimulatedRig rig{axis(), clock};
    Sensor* const sensors[] = {&rig.sensor(0)};
    Guard guard{test::open_guard(1), clock.grid().period_s()};
    Outbox outbox{capacity, 1U << 12U, when_full};
    SweepRunner runner{plan, settings, clock, rig.actuator(), sensors, guard, outbox};
    RunControl control;
    std::atomic<std::size_t> observed{0};
    record::Recorder recorder{outbox, writer, [&](const Record&) {
                                ++observed;
                              }};
    thread.start([&] { runner.run(control); }, [&] { outbox.close(); });
    // Whoever watches reads these while the loop runs.
    while (!outbox.closed()) {
      EXPECT_LE(control.dwell.load(), 3U);
      std::this_thread::yield();
    }
    thread.join();
    recorder.finish();
    EXPECT_GT(observed.load(), 0U);
    writer.finish();
  }
  record::StoredRun run = record::read_sweep(path);
  fs::remove(path);
  return run;
}

TEST(RecordedRun, HoldsWhatTheLoopMeasured) {
  const auto direct = test::run_virtual(short_plan(), axis());
  VirtualClock clock{TickGrid{1000.0}};
  realtime::LoopThread thread;
  // A queue that is full most of the time.
  const record::StoredRun run = record_run(thread, clock, Outbox::WhenFull::wait, 8);
  ASSERT_EQ(run.responses.size(), 1U);
  ASSERT_EQ(run.responses[0].points.size(), direct.sink.points.size());
  for (std::size_t i = 0; i < direct.sink.points.size(); ++i)
    EXPECT_EQ(run.responses[0].points[i].response, direct.sink.points[i].response);
}

TEST(RecordedRun, InRealTimeHoldsEveryPoint) {
  MonotonicClock clock{TickGrid{1000.0}};
  realtime::LoopThread thread{realtime::Settings{}};
  const record::StoredRun run = record_run(thread, clock, Outbox::WhenFull::keep, 1U << 14U);
  ASSERT_EQ(run.responses.size(), 1U);
  EXPECT_EQ(run.responses[0].points.size(), 3U);
  EXPECT_EQ(run.timings.size(), 3U);
  EXPECT_TRUE(run.usage());
}

// The pole of axis(), known to a tenth.
KnownModes mode_of_the_axis() {
  KnownModes modes;
  modes.prior.modes = 1;
  modes.prior.poles[0] = {.sigma_rad_s = -10.0};
  modes.prior.covariance[0] = 1.0;
  modes.noise_variance = {1e-6};
  modes.noise_dof = 100.0;
  return modes;
}

// The loop goes on while a thread of its own solves for the modes of a dwell.
TEST(RecordedRun, InRealTimeModelsTransientsOnAnotherThread) {
  SweepSettings sweep;
  sweep.spacing = Spacing::list;
  sweep.frequencies_hz = {10.0, 20.0, 40.0};
  sweep.amplitude = 0.5;
  sweep.settling = Settling::model;
  RunnerSettings settings = usual_settings();
  settings.real_time = true;
  settings.modes = mode_of_the_axis();
  MonotonicClock clock{TickGrid{1000.0}};
  realtime::LoopThread thread{realtime::Settings{}};
  const record::StoredRun run = record_run(thread, clock, Outbox::WhenFull::keep, 1U << 14U,
                                           plan_sweep(sweep, {}, 1000.0), settings);
  ASSERT_EQ(run.responses.size(), 1U);
  ASSERT_EQ(run.responses[0].points.size(), 3U);
  int modelled = 0;
  for (const record::StoredPoint& point : run.responses[0].points) {
    const std::complex<double> s{0.0, 2.0 * std::numbers::pi * point.frequency_hz};
    EXPECT_NEAR(std::abs(point.response) / std::abs(10.0 / (s + 10.0)), 1.0, 0.05);
    modelled += point.settled_by == "model" ? 1 : 0;
  }
  EXPECT_GT(modelled, 0);
}

}  // namespace
}  // namespace sinerig
