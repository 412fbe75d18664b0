// A sweep that goes on in its middle knows what it would have known.
#include <cmath>

#include <gtest/gtest.h>

#include "support/virtual_run.h"

namespace sinerig {
namespace {

using test::CollectingSink;

sim::SimulatedRigSettings resonant_rig(double noise_rms) {
  sim::SimulatedRigSettings rig;
  rig.system = sim::from_transfer_function({400.0 * 3.0}, {1.0, 4.0, 400.0});
  rig.sensors.resize(1);
  rig.sensors[0].imperfections.noise_rms = noise_rms;
  return rig;
}

SweepPlan levelled_plan(std::uint32_t refine_points = 4) {
  SweepSettings sweep;
  sweep.start_hz = 0.5;
  sweep.stop_hz = 20.0;
  sweep.points = 12;
  sweep.amplitude = 1.0;
  sweep.level = {.response = 0.5, .most_response = 1.5, .least_amplitude = 1e-3, .retries = 2};
  sweep.refine_points = refine_points;
  sweep.refine_db = 0.05;
  return plan_sweep(sweep, {}, 200.0);
}

struct Measured {
  CollectingSink sink;
  RunOutcome outcome;
  bool to_measure = true;
  std::size_t dwells = 0;
};

Measured run_from(const SweepPlan& plan, double noise_rms, const FinishedDwells& finished,
                  const RunnerSettings& how = {}) {
  Measured run;
  VirtualClock clock{TickGrid{plan.rate_hz}};
  const sim::SimulatedRigSettings settings = resonant_rig(noise_rms);
  sim::SimulatedRig rig{settings, clock};
  Sensor* const sensors[] = {&rig.sensor(0)};
  Guard guard{test::open_guard(1), clock.grid().period_s()};
  SweepRunner runner{plan, how, clock, rig.actuator(), sensors, guard, run.sink};
  run.to_measure = runner.go_on(finished);
  RunControl control;
  if (run.to_measure) run.outcome = runner.run(control);
  run.dwells = runner.dwells().size();
  return run;
}

std::vector<std::uint32_t> refined(const Measured& run) {
  std::vector<std::uint32_t> candidates;
  for (const Event& event : run.sink.events) {
    if (event.kind == EventKind::refined) candidates.push_back(event.candidate);
  }
  return candidates;
}

// What a file would hold of the first dwells of a run, the first `added` of its refined dwells
// among what is known.
FinishedDwells first_of(const Measured& run, std::uint32_t dwells, std::size_t added = 0) {
  std::vector<std::uint32_t> candidates = refined(run);
  candidates.resize(added);
  FinishedDwells finished{
      .dwells = dwells, .points = {}, .lessons = {}, .condemned = {}, .refined = candidates};
  for (const Point& point : run.sink.points) {
    if (point.dwell < dwells) finished.points.push_back(point);
  }
  for (const Lesson& lesson : run.sink.lessons) {
    if (lesson.dwell < dwells) finished.lessons.push_back(lesson);
  }
  return finished;
}

// The amplitude that the first block of a dwell was measured with.
double first_amplitude(const Measured& run, std::uint32_t dwell) {
  for (const Block& block : run.sink.blocks) {
    if (block.dwell == dwell && block.channel == applied_channel)
      return std::abs(block.coefficients.phasor());
  }
  return 0.0;
}

class GoingOn : public testing::TestWithParam<std::uint32_t> {};

TEST_P(GoingOn, MeasuresTheRestAtTheSameLevelsAndPlaces) {
  // Beside the resonance; further places would be as good as each other.
  const SweepPlan plan = levelled_plan(2);
  const Measured whole = run_from(plan, 0.0, {});
  ASSERT_FALSE(whole.outcome.trip.tripped());
  ASSERT_GT(whole.dwells, plan.dwells.size()) << "nothing was refined";
  const std::uint32_t kept = GetParam();
  const std::size_t added = kept > plan.dwells.size() ? kept - plan.dwells.size() : 0;
  const Measured rest = run_from(plan, 0.0, first_of(whole, kept, added));
  EXPECT_EQ(rest.outcome.dwells_done, whole.outcome.dwells_done);
  ASSERT_EQ(rest.sink.points.size(), whole.sink.points.size() - kept);
  for (std::size_t i = 0; i < rest.sink.points.size(); ++i) {
    const Point& a = whole.sink.points[kept + i];
    const Point& b = rest.sink.points[i];
    EXPECT_EQ(a.dwell, b.dwell);
    if (a.dwell >= plan.dwells.size()) {
      // The last digits of the points around decide between neighbours.
      EXPECT_NEAR(b.frequency_hz / a.frequency_hz, 1.0, 0.05);
      continue;
    }
    EXPECT_EQ(a.frequency_hz, b.frequency_hz);
    // The level comes from the points before; the plant starts from rest instead of in motion.
    EXPECT_NEAR(b.input_amplitude / a.input_amplitude, 1.0, 2e-3) << a.frequency_hz;
    EXPECT_NEAR(std::abs(b.response / a.response - 1.0), 0.0, 6e-3) << a.frequency_hz;
  }
}

INSTANTIATE_TEST_SUITE_P(Dwells, GoingOn, testing::Range(0U, 14U));

// What its gain and phase are to be is known of the first dwell, of no other.
TEST(RestOfASweep, HasThePreflightOfTheFirstDwell) {
  const SweepPlan plan = levelled_plan();
  const Measured whole = run_from(plan, 0.0, {});
  RunnerSettings how;
  how.preflight = {.wanted = true, .min_phase_deg = -20.0, .max_phase_deg = 5.0};
  const Measured fresh = run_from(plan, 0.0, {}, how);
  for (const std::uint32_t kept : {1U, 3U, 8U, 9U, 10U, 11U}) {
    const Measured rest = run_from(plan, 0.0, first_of(whole, kept), how);
    EXPECT_FALSE(rest.outcome.trip.tripped()) << kept;
    ASSERT_EQ(rest.sink.preflights.size(), 1U);
    EXPECT_NEAR(rest.sink.preflights[0].amplitude, fresh.sink.preflights[0].amplitude, 1e-12);
    EXPECT_EQ(rest.sink.preflights[0].frequency_hz, whole.sink.points[0].frequency_hz);
    ASSERT_EQ(rest.sink.points.size(), whole.sink.points.size() - kept);
    EXPECT_EQ(rest.sink.points[0].dwell, kept);
    EXPECT_EQ(rest.sink.points[0].frequency_hz, whole.sink.points[kept].frequency_hz);
    EXPECT_NEAR(std::abs(rest.sink.points[0].response / whole.sink.points[kept].response - 1.0),
                0.0, 6e-3);
  }
  // One that fails has measured nothing of the dwell that comes.
  how.preflight.max_gain = 1e-3;
  const Measured failed = run_from(plan, 0.0, first_of(whole, 8), how);
  EXPECT_EQ(failed.outcome.trip.cause, TripCause::preflight_gain);
  EXPECT_TRUE(failed.sink.points.empty());
}

TEST(RestOfASweep, BeginsWithExactlyWhatWasLearnt) {
  const SweepPlan plan = levelled_plan();
  const Measured whole = run_from(plan, 0.01, {});
  ASSERT_GE(whole.sink.lessons.size(), 12U);
  // The amplitude of the first attempt follows from the recalled points alone, to the last bit.
  const Measured rest = run_from(plan, 0.01, first_of(whole, 8));
  EXPECT_NEAR(first_amplitude(rest, 8), first_amplitude(whole, 8), 1e-12);
  EXPECT_NE(first_amplitude(rest, 8), 0.0);
  // Without the lessons the colour of the noise would have to be learnt anew.
  FinishedDwells forgetful = first_of(whole, 8);
  forgetful.lessons.clear();
  const Measured again = run_from(plan, 0.01, forgetful);
  EXPECT_GT(rest.sink.points.front().dof, again.sink.points.front().dof);
}

// The first part went on behind it without having learnt anything of the level.
TEST(RestOfASweep, LearnsNoLevelFromWhatASoftLimitGaveUp) {
  const SweepPlan plan = levelled_plan();
  const Measured whole = run_from(plan, 0.0, {});
  FinishedDwells given_up = first_of(whole, 8);
  FinishedDwells without = given_up;
  ASSERT_EQ(given_up.points.back().dwell, 7U);
  without.points.pop_back();
  Point& last = given_up.points.back();
  last.status = PointStatus::stopped;
  last.reason = PointReason::soft_limit;
  last.response *= 0.2;
  const double amplitude = first_amplitude(run_from(plan, 0.0, given_up), 8);
  EXPECT_GT(amplitude, 0.0);
  EXPECT_NEAR(amplitude, first_amplitude(run_from(plan, 0.0, without), 8), 1e-12);
}

TEST(RestOfASweep, ChoosesTheSameRefinementsAndTellsOnlyOfNewOnes) {
  const SweepPlan plan = levelled_plan();
  const Measured whole = run_from(plan, 0.0, {});
  const std::vector<std::uint32_t> all = refined(whole);
  ASSERT_GE(all.size(), 2U);
  // The first pass is done; the first added dwell may or may not have been measured.
  const auto first_pass = static_cast<std::uint32_t>(plan.dwells.size());
  EXPECT_EQ(refined(run_from(plan, 0.0, first_of(whole, first_pass))).front(), all[0]);
  EXPECT_EQ(refined(run_from(plan, 0.0, first_of(whole, first_pass, 1))).front(), all[1]);
  EXPECT_EQ(refined(run_from(plan, 0.0, first_of(whole, first_pass + 1, 1))).front(), all[1]);
}

// A point that has been measured again since may call for another place: those chosen stay.
TEST(RestOfASweep, KeepsTheRefinementsThatWereChosen) {
  const SweepPlan plan = levelled_plan();
  const Measured whole = run_from(plan, 0.0, {});
  const std::size_t added = whole.dwells - plan.dwells.size();
  ASSERT_EQ(added, 4U);
  FinishedDwells finished = first_of(whole, static_cast<std::uint32_t>(whole.dwells), added);
  for (Point& point : finished.points) {
    if (point.dwell % 2 == 0) point.response *= std::complex<double>{0.6, 0.3};
  }
  finished.dwells -= 2;
  const Measured rest = run_from(plan, 0.0, finished);
  EXPECT_TRUE(refined(rest).empty());
  ASSERT_EQ(rest.sink.points.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    const Point& point = whole.sink.points[whole.sink.points.size() - 2 + i];
    EXPECT_EQ(rest.sink.points[i].dwell, point.dwell);
    EXPECT_EQ(rest.sink.points[i].frequency_hz, point.frequency_hz);
  }
}

TEST(RestOfASweep, KnowsWhenNothingIsLeft) {
  const SweepPlan plan = levelled_plan();
  const Measured whole = run_from(plan, 0.0, {});
  const auto all = static_cast<std::uint32_t>(whole.dwells);
  const Measured rest =
      run_from(plan, 0.0, first_of(whole, all, whole.dwells - plan.dwells.size()));
  EXPECT_FALSE(rest.to_measure);
  EXPECT_TRUE(rest.sink.events.empty());
}

}  // namespace
}  // namespace sinerig
