// What keeps modelled sweeps honest: dwells measured both ways, a model of the whole sweep, what is
// condemned measured again, also after an interruption.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "support/virtual_run.h"
#include "sweep/model_trust.h"
#include "sweep/sweep_review.h"

namespace sinerig {
namespace {

constexpr double rate_hz = 1000.0;
constexpr double two_pi = 2.0 * std::numbers::pi;
constexpr double stiffness = 0.02 * (two_pi * 8.0) * (two_pi * 8.0);

sim::SimulatedRigSettings damped_axis() {
  sim::SimulatedRigSettings rig;
  sim::MechanicalAxis axis;
  axis.inertia = 0.02;
  axis.damping = 0.1;
  axis.stiffness = stiffness;
  rig.system = sim::from_mechanical_axis(axis);
  rig.sensors = {{.output = 0, .imperfections = {.noise_rms = 1e-5}}};
  return rig;
}

ModePrior its_mode() {
  const double sigma = -0.1 / 0.02 / 2.0;
  ModePrior prior;
  prior.modes = 1;
  prior.poles[0] = {.sigma_rad_s = sigma,
                    .omega_rad_s = std::sqrt(std::pow(two_pi * 8.0, 2) - sigma * sigma)};
  for (std::size_t i = 0; i < 2; ++i) prior.covariance[triangle(i) + i] = 0.01;
  return prior;
}

RunnerSettings told() {
  RunnerSettings settings;
  settings.modes = KnownModes{.prior = its_mode(), .noise_variance = {1e-10}, .noise_dof = 100.0};
  return settings;
}

SweepPlan modelled_plan(double check_fraction) {
  SweepSettings sweep;
  sweep.start_hz = 1.0;
  sweep.stop_hz = 100.0;
  sweep.points = 16;
  sweep.amplitude = 1.0;
  sweep.frequency_tolerance = 5e-3;
  sweep.settling = Settling::model;
  sweep.check_fraction = check_fraction;
  return plan_sweep(sweep, {}, rate_hz);
}

std::vector<Event> events_of(const test::CollectingSink& sink, EventKind kind) {
  std::vector<Event> found;
  std::copy_if(sink.events.begin(), sink.events.end(), std::back_inserter(found),
               [&](const Event& event) { return event.kind == kind; });
  return found;
}

TEST(ModelledSweep, ChecksAsManyDwellsAsItIsTold) {
  const test::VirtualRun all =
      test::run_virtual(modelled_plan(1.0), damped_axis(), test::open_guard(1), told());
  ASSERT_EQ(all.sink.points.size(), 16U);
  const std::vector<Event> checked = events_of(all.sink, EventKind::checked);
  std::size_t both = 0;
  for (const Point& point : all.sink.points) {
    EXPECT_EQ(point.status, PointStatus::good) << point.frequency_hz;
    both += point.settled_by == SettledBy::both ? 1 : 0;
  }
  EXPECT_GE(both, 14U);
  EXPECT_EQ(checked.size(), both);
  for (const Event& event : checked) EXPECT_LT(event.value, 0.1);
  const test::VirtualRun none =
      test::run_virtual(modelled_plan(0.0), damped_axis(), test::open_guard(1), told());
  EXPECT_TRUE(events_of(none.sink, EventKind::checked).empty());
  EXPECT_LT(none.outcome.ticks, all.outcome.ticks);
}

TEST(ModelTrust, BelievesNoModesAfterAContradiction) {
  KnownModes found;
  found.prior = its_mode();
  ModelTrust trust{3};
  trust.dwell_ended(0, true, false);
  trust.dwell_ended(1, false, false);
  trust.contradicted();
  ASSERT_TRUE(trust.doubted());
  // The same modes again: they are not what is wrong.
  EXPECT_EQ(trust.probed(&found, its_mode()), ModelTrust::Judgement::given_up);
  EXPECT_EQ(trust.next_condemned(0), 0U);
  EXPECT_EQ(trust.next_condemned(1), 3U);
}

// Finds the mode of the axis in whatever it is shown.
class ToldFinder final : public ModeFinder {
 public:
  bool find(const ProbeRecord& record, KnownModes& modes) noexcept override {
    const test::OutsideTheLoop looking;
    loudest = 0.0;
    for (const double value : record.applied) loudest = std::max(loudest, std::abs(value));
    modes = *told().modes;
    return true;
  }
  double loudest = 0.0;
};

// The chirp goes through the resonance; a soft limit is answered as in a dwell.
TEST(ModelledSweep, PlaysItsFirstPassMoreQuietlyAfterASoftLimit) {
  ToldFinder finder;
  RunnerSettings settings;
  settings.finder = &finder;
  settings.retry = {.soft = 5, .soft_wait_s = 0.1};
  GuardSettings guard = test::open_guard(1);
  guard.channels[0].soft_max = 0.04;
  const test::VirtualRun run =
      test::run_virtual(modelled_plan(0.0), damped_axis(), guard, settings);
  EXPECT_FALSE(run.outcome.trip.tripped()) << describe(run.outcome.trip, {"y"});
  EXPECT_GT(run.outcome.soft_trips, 0U);
  EXPECT_GT(finder.loudest, 0.0);
  EXPECT_LT(finder.loudest, 0.6);
  EXPECT_EQ(run.outcome.dwells_done, 16U);
}

// Notes down in which order it is told of doubt and of finished dwells.
class OrderedSink final : public RecordSink {
 public:
  void put(const Record& record) noexcept override {
    const test::OutsideTheLoop noting_down;
    if (const auto* timing = std::get_if<DwellTiming>(&record)) {
      told.push_back({.dwell = timing->dwell, .value = -1.0});
    }
    const auto* event = std::get_if<Event>(&record);
    if (event != nullptr && event->kind == EventKind::model_doubted) {
      told.push_back({.dwell = event->dwell, .value = event->value});
    }
  }
  void put_sample(const TickSamples&) noexcept override {}
  bool flush() noexcept override { return true; }

  struct Told {
    std::uint32_t dwell;
    double value;  // of model_doubted; −1: the dwell's timing
  };
  std::vector<Told> told;
};

// Whoever goes on after a kill finds it with the points of the dwell that raised it.
TEST(ModelledSweep, SaysThatItDoubtsItsModesBeforeItLooksForOthers) {
  RunnerSettings wrong = told();
  ModePole& pole = wrong.modes->prior.poles[0];
  pole = {.sigma_rad_s = -0.2, .omega_rad_s = two_pi * 23.0};
  for (std::size_t i = 0; i < 2; ++i) wrong.modes->prior.covariance[triangle(i) + i] = 1e-6;
  const SweepPlan plan = modelled_plan(0.0);
  VirtualClock clock{TickGrid{rate_hz}};
  const sim::SimulatedRigSettings settings = damped_axis();
  sim::SimulatedRig rig{settings, clock};
  Sensor* const sensors[] = {&rig.sensor(0)};
  Guard guard{test::open_guard(1), clock.grid().period_s()};
  OrderedSink sink;
  SweepRunner runner{plan, wrong, clock, rig.actuator(), sensors, guard, sink};
  RunControl control;
  EXPECT_FALSE(runner.run(control).trip.tripped());
  const auto begins =
      std::find_if(sink.told.begin(), sink.told.end(),
                   [](const OrderedSink::Told& each) { return each.value == doubt_begins; });
  ASSERT_LT(begins, sink.told.end() - 2);
  EXPECT_EQ(begins[1].dwell, begins->dwell);
  EXPECT_EQ(begins[1].value, -1.0);
  EXPECT_EQ(begins[2].dwell, begins->dwell);
  EXPECT_EQ(begins[2].value, 2.0) << "given up: nobody looks for modes here";
}

// What an earlier part of the run has left: all dwells finished, two condemned.
TEST(ModelledSweep, GoesOnWithWhatWasCondemned) {
  const SweepPlan plan = modelled_plan(0.0);
  const test::VirtualRun whole =
      test::run_virtual(plan, damped_axis(), test::open_guard(1), told());
  FinishedDwells finished{
      .dwells = 16, .points = whole.sink.points, .lessons = {}, .condemned = {3, 7}, .refined = {}};
  VirtualClock clock{TickGrid{rate_hz}};
  const sim::SimulatedRigSettings settings = damped_axis();
  sim::SimulatedRig rig{settings, clock};
  Sensor* const sensors[] = {&rig.sensor(0)};
  Guard guard{test::open_guard(1), clock.grid().period_s()};
  test::CollectingSink sink;
  SweepRunner runner{plan, told(), clock, rig.actuator(), sensors, guard, sink};
  ASSERT_TRUE(runner.go_on(finished));
  RunControl control;
  EXPECT_FALSE(runner.run(control).trip.tripped());
  ASSERT_EQ(sink.points.size(), 2U);
  EXPECT_EQ(sink.points[0].dwell, 3U);
  EXPECT_EQ(sink.points[1].dwell, 7U);
  for (const Point& point : sink.points) {
    EXPECT_EQ(point.settled_by, SettledBy::detection);
    EXPECT_EQ(point.status, PointStatus::good);
    EXPECT_NEAR(std::abs(point.response / whole.sink.points[point.dwell].response - 1.0), 0.0,
                0.02);
  }
  EXPECT_EQ(events_of(sink, EventKind::remeasured).size(), 2U);
}

// A dwell whose time is up before the noise allows the target says that its model is at its limit.
TEST(ModelledSweep, SaysWhichDwellsEndedAtTheirLimit) {
  SweepSettings sweep;
  sweep.frequencies_hz = {4.0};
  sweep.spacing = Spacing::list;
  sweep.amplitude = 1.0;
  sweep.settling = Settling::model;
  sweep.check_fraction = 0.0;
  sweep.settle_max = {.cycles = 1.0, .seconds = 0.2};
  sweep.integrate_max = {.cycles = 2.0, .seconds = 0.5};
  sim::SimulatedRigSettings rig = damped_axis();
  rig.sensors[0].imperfections.noise_rms = 1e-2;
  rig.sensors.push_back(rig.sensors[0]);
  sweep.target_of_first = true;  // of the other nothing is asked, but that its model holds
  RunnerSettings settings = told();
  settings.modes->noise_variance = {1e-4, 1e-4};
  const test::VirtualRun run =
      test::run_virtual(plan_sweep(sweep, {}, rate_hz), rig, test::open_guard(2), settings);
  ASSERT_EQ(run.sink.points.size(), 2U);
  EXPECT_EQ(run.sink.points[1].reason, PointReason::model_at_limit);
  const Point& point = run.sink.points[0];
  EXPECT_EQ(point.settled_by, SettledBy::model);
  EXPECT_EQ(point.status, PointStatus::unsettled);
  EXPECT_EQ(point.reason, PointReason::model_at_limit);
  EXPECT_GT(point.reason_value, sweep.target_db);
}

// H behind the hold of a mode with a dead time of a tick and a half.
std::complex<double> held_mode(double hz) {
  const std::complex<double> ahead = std::polar(1.0, two_pi * hz / rate_hz);
  const ModePole pole = its_mode().poles[0];
  const std::complex<double> z =
      std::exp(std::complex<double>{pole.sigma_rad_s, pole.omega_rad_s} / rate_hz);
  const std::complex<double> residue{0.3, -1.2};
  const auto part = [&](std::complex<double> c, std::complex<double> of) {
    return c * (1.0 - of) / (ahead - of);
  };
  const std::complex<double> mode = part(residue, z) + part(std::conj(residue), std::conj(z));
  return mode * (0.5 / ahead + 0.5 / (ahead * ahead));
}

class Review : public testing::Test {
 protected:
  static constexpr std::uint32_t dwells = 30;

  // `wrong` of them by 3 %.
  void see(std::uint32_t wrong) {
    for (std::uint32_t dwell = 0; dwell < dwells; ++dwell) {
      Point point;
      point.dwell = dwell;
      point.frequency_hz = std::pow(100.0, static_cast<double>(dwell) / (dwells - 1));
      point.response = held_mode(point.frequency_hz) * (dwell == wrong ? 1.03 : 1.0);
      const double sigma = 1e-4 * std::abs(point.response);
      point.covariance = {sigma * sigma, 0.0, sigma * sigma};
      review_.set(point);
    }
    review_.ask(its_mode());
    ASSERT_TRUE(review_.ready());
  }
  SweepReview review_{dwells, 1, rate_hz, 0.0067, Deputy::Where::at_once};
};

TEST_F(Review, AgreesWithASweepThatIsRight) {
  see(dwells);
  for (std::uint32_t dwell = 0; dwell < dwells; ++dwell)
    EXPECT_EQ(review_.disagreement(dwell), 0.0) << dwell;
}

TEST_F(Review, FindsThePointThatTheOthersContradict) {
  see(12);
  EXPECT_NEAR(review_.disagreement(12), 0.03, 0.005);
  EXPECT_EQ(review_.disagreement(3), 0.0);
  EXPECT_EQ(review_.disagreement(25), 0.0);
}

TEST(ReviewOfFewPoints, TellsNothing) {
  SweepReview review{6, 1, rate_hz, 0.0067, Deputy::Where::at_once};
  for (std::uint32_t dwell = 0; dwell < 6; ++dwell) {
    Point point;
    point.dwell = dwell;
    point.frequency_hz = 1.0 + dwell;
    point.response = dwell == 3 ? 2.0 : 1.0;
    point.covariance = {1e-8, 0.0, 1e-8};
    review.set(point);
  }
  review.ask(its_mode());
  for (std::uint32_t dwell = 0; dwell < 6; ++dwell) EXPECT_EQ(review.disagreement(dwell), 0.0);
}

}  // namespace
}  // namespace sinerig
