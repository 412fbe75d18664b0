// Refinement: a resonance between two points of the first pass is found, noise is not chased, and
// the added dwells are like all others.
#include "sweep/refiner.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "support/virtual_run.h"

namespace sinerig {
namespace {

constexpr double rate_hz = 1000.0;
constexpr double two_pi = 2.0 * std::numbers::pi;

SweepSettings first_pass() {
  SweepSettings sweep;
  sweep.start_hz = 0.5;
  sweep.stop_hz = 200.0;
  sweep.points = 60;
  sweep.amplitude = 0.2;
  sweep.refine_points = 30;
  return sweep;
}

// A rigid body with one lightly damped mode, and a delay.
struct Gimbal {
  double mode_hz = 23.0;
  double damping = 0.003;
  double residue = 30.0;

  std::complex<double> at(double frequency_hz) const {
    const std::complex<double> s{0.0, two_pi * frequency_hz};
    const double omega = two_pi * mode_hz;
    const auto rigid = 1.0 / (0.02 * s * s + 0.1 * s);
    return (rigid + residue / (s * s + 2.0 * damping * omega * s + omega * omega)) *
           std::exp(-0.0015 * s);
  }
};

struct Refined {
  std::vector<double> frequencies_hz;  // added
  double worst_db = 0.0;
};

// Measures the plan's frequencies and what the refiner asks for, with relative noise.
Refined refine(const Gimbal& gimbal, double noise, std::uint64_t seed) {
  std::mt19937_64 generator{seed};
  std::normal_distribution<double> normal;
  const SweepPlan plan = plan_sweep(first_pass(), {}, rate_hz);
  Refiner refiner{plan.refinement, rate_hz, plan.dwells.size() + 30, 1};
  const auto measure = [&](const Dwell& dwell) {
    const double frequency_hz = dwell.frequency_hz(rate_hz);
    const std::complex<double> exact = gimbal.at(frequency_hz);
    const double sigma = noise * std::abs(exact);
    refiner.add(frequency_hz);
    refiner.set(0, exact + sigma * std::complex<double>{normal(generator), normal(generator)},
                sigma * sigma);
    refiner.learn();
  };
  for (const Dwell& dwell : plan.dwells) measure(dwell);
  Refined refined;
  while (refined.frequencies_hz.size() < 30) {
    const auto next = refiner.next();
    if (!next) break;
    const Dwell& dwell = plan.refinement.candidates[*next];
    refined.frequencies_hz.push_back(dwell.frequency_hz(rate_hz));
    measure(dwell);
  }
  refined.worst_db = refiner.worst_db();
  return refined;
}

TEST(Refiner, FindsANarrowResonanceWhereverItLies) {
  std::mt19937_64 generator{3};
  std::uniform_real_distribution<double> log_hz{std::log(5.0), std::log(150.0)};
  for (int i = 0; i < 200; ++i) {
    const Gimbal gimbal{.mode_hz = std::exp(log_hz(generator))};
    const Refined refined = refine(gimbal, 1e-3, static_cast<std::uint64_t>(i));
    EXPECT_LE(refined.worst_db, 0.5) << gimbal.mode_hz;
    // At least one point within the half-power bandwidth, which is 2 ζ f wide.
    const double width_hz = 2.0 * gimbal.damping * gimbal.mode_hz;
    const bool found =
        std::any_of(refined.frequencies_hz.begin(), refined.frequencies_hz.end(),
                    [&](double hz) { return std::abs(hz - gimbal.mode_hz) < width_hz; });
    const SweepPlan plan = plan_sweep(first_pass(), {}, rate_hz);
    const bool hit = std::any_of(plan.dwells.begin(), plan.dwells.end(), [&](const Dwell& dwell) {
      return std::abs(dwell.frequency_hz(rate_hz) - gimbal.mode_hz) < width_hz;
    });
    EXPECT_TRUE(found || hit) << gimbal.mode_hz << " Hz";
  }
}

TEST(Refiner, DoesNotChaseNoise) {
  const Gimbal smooth{.mode_hz = 30.0, .damping = 0.5, .residue = 30.0};
  std::size_t added = 0;
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    added += refine(smooth, 5e-3, seed).frequencies_hz.size();
  }
  EXPECT_LE(added, 25U);  // of 50 sweeps of 60 points
}

TEST(Refiner, LeavesASmoothResponseAlone) {
  const Gimbal smooth{.mode_hz = 30.0, .damping = 0.5, .residue = 30.0};
  EXPECT_TRUE(refine(smooth, 0.0, 1).frequencies_hz.empty());
}

TEST(Refinement, CandidatesRespectTheLimitsAndLieBetweenThePoints) {
  SweepSettings sweep = first_pass();
  MotionLimits limits;
  limits.velocity_max = 0.2 * two_pi * 200.0 * 1.001;
  const SweepPlan plan = plan_sweep(sweep, limits, rate_hz);
  EXPECT_GT(plan.refinement.candidates.size(), 1000U);
  for (const Dwell& dwell : plan.refinement.candidates) {
    EXPECT_GT(dwell.frequency_hz(rate_hz), plan.dwells.front().frequency_hz(rate_hz));
    EXPECT_LT(dwell.frequency_hz(rate_hz), plan.dwells.back().frequency_hz(rate_hz));
  }
}

TEST(Refinement, OfARunAddsPointsAndSaysSo) {
  SweepSettings sweep = first_pass();
  sweep.start_hz = 5.0;
  sweep.points = 25;
  const SweepPlan plan = plan_sweep(sweep, {}, rate_hz);
  sim::MechanicalAxis axis;
  axis.inertia = 0.02;
  axis.damping = 0.1;
  axis.modes = {{.frequency_hz = 24.1, .damping = 0.003, .residue = 30.0}};
  sim::SimulatedRigSettings rig;
  rig.system = sim::from_mechanical_axis(axis);
  rig.sensors.resize(1);
  rig.sensors[0].imperfections.noise_rms = 1e-6;
  const auto run = test::run_virtual(plan, rig);
  std::size_t added = 0;
  for (const Event& event : run.sink.events) {
    if (event.kind != EventKind::refined) continue;
    EXPECT_EQ(event.dwell, plan.dwells.size() + added);
    EXPECT_GT(event.value, 0.5);
    ++added;
  }
  EXPECT_GT(added, 2U);
  EXPECT_LE(added, 30U);
  EXPECT_EQ(run.outcome.dwells_done, plan.dwells.size() + added);
  EXPECT_EQ(run.sink.points.size(), plan.dwells.size() + added);
  EXPECT_TRUE(std::any_of(run.sink.points.begin(), run.sink.points.end(), [](const Point& point) {
    return std::abs(point.frequency_hz - 24.1) < 0.15;
  }));
}

}  // namespace
}  // namespace sinerig
