// The loop on its thread, the recorder on another, the queue between them: what is in the file is
// what the loop measured. Under the preset `tsan` the thread sanitizer watches.
#include <filesystem>

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

record::StoredRun record_run(realtime::LoopThread& thread, Clock& clock, Outbox::WhenFull when_full,
                             std::size_t capacity) {
  const fs::path path =
      fs::path{testing::TempDir()} /
      (std::string{testing::UnitTest::GetInstance()->current_test_info()->name()} + ".sweep");
  fs::remove(path);
  {
    const SweepPlan plan = short_plan();
    record::RunInfo info{
        .rig_name = "rig.toml", .rig_text = "", .clock = "", .channels = {}, .plan = plan};
    info.channels = {{"command", "1"}, {"applied", "1"}, {"y", "1"}};
    record::SweepWriter writer{path, info, record::SweepWriter::IfExists::refuse};
    sim::SimulatedRig rig{axis(), clock};
    Sensor* const sensors[] = {&rig.sensor(0)};
    Guard guard{test::open_guard(1), clock.grid().period_s()};
    Outbox outbox{capacity, 1U << 12U, when_full};
    SweepRunner runner{
        plan,    {.responses = {}, .readbacks = {}, .record_samples = true, .max_gap_s = 60.0},
        clock,   rig.actuator(),
        sensors, guard,
        outbox};
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

}  // namespace
}  // namespace sinerig
