// Transients that are modelled: closed forms, wrong poles that are found out, wrong orders that are
// not believed.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "support/virtual_run.h"
#include "sweep/modal_dwell.h"
#include "sweep/modal_estimate.h"
#include "sweep/modal_settling.h"
#include "sweep/model_trust.h"
#include "sweep/probe.h"

namespace sinerig {
namespace {

constexpr double rate_hz = 1000.0;
constexpr double two_pi = 2.0 * std::numbers::pi;
constexpr ModePole ringing{.sigma_rad_s = -0.5, .omega_rad_s = two_pi * 23.0};
constexpr ModePole slow{.sigma_rad_s = -5.0, .omega_rad_s = 0.0};

// y = 0.8 cos φ − 0.3 sin φ + 0.1 + 0.5 Re[(1 − 2j) e^{ringing t}] + 0.7 e^{slow t} + noise.
double transient_at(double t) {
  const double decay = std::exp(ringing.sigma_rad_s * t);
  const double angle = ringing.omega_rad_s * t;
  return 0.5 * decay * (std::cos(angle) + 2.0 * std::sin(angle)) +
         0.7 * std::exp(slow.sigma_rad_s * t);
}

constexpr std::complex<double> true_tone{-0.3, 0.8};  // b + j a

void fill(ModalStore& store, double tone_hz, double noise_rms, std::uint64_t ticks) {
  std::mt19937_64 random{7};
  std::normal_distribution<double> noise{0.0, noise_rms};
  for (std::uint64_t k = 0; k < ticks; ++k) {
    const double t = static_cast<double>(k) / rate_hz;
    const double phase = two_pi * tone_hz * t;
    const Phasor tone{.cosine = std::cos(phase), .sine = std::sin(phase)};
    const double value = 0.8 * tone.cosine - 0.3 * tone.sine + 0.1 + transient_at(t) +
                         (noise_rms > 0.0 ? noise(random) : 0.0);
    const std::vector<Observation> observed{{.value = tone.sine}, {.value = value}};
    store.add(tone, observed);
  }
}

ModePrior prior_of(std::vector<ModePole> poles, double relative) {
  ModePrior prior;
  std::size_t index = 0;
  for (const ModePole& pole : poles) {
    prior.poles[prior.modes++] = pole;
    const double size = std::hypot(pole.sigma_rad_s, pole.omega_rad_s);
    for (std::size_t k = 0; k < pole.size(); ++k, ++index) {
      prior.covariance[triangle(index) + index] = std::pow(relative * size, 2);
    }
  }
  return prior;
}

ModalSums sums_of(const ModalStore& store, std::span<const ModePole> poles, double tone_hz) {
  ModalRegression regression;
  regression.linearise(poles, 1.0 / rate_hz, two_pi * tone_hz);
  ModalSums sums;
  sums.clear(regression.columns());
  ModalSample sample;
  for (std::uint64_t k = 0; k < store.count(); ++k) {
    EXPECT_TRUE(store.sample(1, k, sample));
    regression.go_to(k);
    regression.add(sample, sums);
  }
  return sums;
}

TEST(ModalSolver, FindsTheToneUnderATransientOfKnownModesWithinHalfACycle) {
  ModalStore store{2, 1000};
  fill(store, 2.0, 0.0, 250);
  const std::vector<ModePole> poles{ringing, slow};
  PoleBelief belief;
  for (std::size_t i = 0; i < 3; ++i) belief.precision[triangle(i) + i] = 1e12;
  ModalSolver solver;
  ModalSolution solution;
  ASSERT_TRUE(solver.solve(sums_of(store, poles, 2.0), poles, belief, 1e-8, solution));
  EXPECT_NEAR(std::abs(solution.tone - true_tone), 0.0, 1e-6);
  EXPECT_NEAR(solution.mean, 0.1, 1e-6);
}

// The recursion e^{s t} and its anchors against the exponential itself.
TEST(ModalRegression, KeepsTheModesExactOverManyTicks) {
  ModalRegression regression;
  const std::vector<ModePole> poles{{.sigma_rad_s = -0.01, .omega_rad_s = 300.0}};
  regression.linearise(poles, 1.0 / rate_hz, 1.0);
  ModalSums sums;
  sums.clear(regression.columns());
  for (std::uint64_t k = 0; k <= 10'000; ++k) {
    regression.go_to(k);
    regression.add({.tone = {}, .value = 0.0}, sums);
  }
  const std::complex<double> exact = std::exp(std::complex<double>{-0.01, 300.0} * 10.0);
  EXPECT_NEAR(regression.regressors()[3], exact.real(), 1e-12);
  EXPECT_NEAR(regression.regressors()[4], exact.imag(), 1e-12);
  EXPECT_NEAR(regression.regressors()[5], 10.0 * exact.real(), 1e-11);
}

struct Dwelt {
  ModalVerdict verdict = ModalVerdict::going_on;
  ModalDoubt doubt = ModalDoubt::none;
  ModalResult result;
  ModePrior prior;
};

Dwelt dwell(const ModePrior& prior, double noise_rms) {
  constexpr double tone_hz = 2.0;
  ModalStore store{2, 5000};
  fill(store, tone_hz, noise_rms, 4000);
  ModalSettling settling{{1}, rate_hz};
  const double variance = noise_rms * noise_rms;
  settling.know(prior, {&variance, 1}, 1000.0);
  settling.start({.omega_rad_s = two_pi * tone_hz,
                  .cycle_samples = 500,
                  .least_samples = 500,
                  .target_db = 0.05,
                  .target_deg = 0.3});
  Dwelt dwelt;
  for (std::uint64_t count = 1; count <= 4000; ++count) {
    dwelt.verdict = settling.look(store, count);
    if (dwelt.verdict != ModalVerdict::going_on) break;
  }
  dwelt.doubt = settling.doubt();
  dwelt.result = settling.result(0);
  dwelt.prior = settling.prior();
  return dwelt;
}

TEST(ModalSettling, LearnsPolesThatItWasToldWrong) {
  ModePole wrong = ringing;
  wrong.omega_rad_s *= 1.02;
  wrong.sigma_rad_s *= 1.3;
  const Dwelt dwelt = dwell(prior_of({wrong, slow}, 0.03), 1e-4);
  ASSERT_EQ(dwelt.verdict, ModalVerdict::accepted);
  EXPECT_NEAR(std::abs(dwelt.result.estimate.response - true_tone), 0.0, 2e-3);
  EXPECT_NEAR(dwelt.prior.poles[0].omega_rad_s / ringing.omega_rad_s, 1.0, 1e-4);
}

TEST(ModalSettling, GivesUpAModelThatLacksAMode) {
  const Dwelt dwelt = dwell(prior_of({slow}, 0.01), 1e-4);
  EXPECT_EQ(dwelt.verdict, ModalVerdict::abandoned);
  EXPECT_EQ(dwelt.doubt, ModalDoubt::residual);
}

// A dwell at its limit: asked for beside the loop or at once, the best that is known is the same.
TEST(ModalDwell, ConcludesBesideTheLoopAsItWouldAtOnce) {
  constexpr double tone_hz = 2.0;
  const double variance = 1e-4;  // too loud for the target
  const auto concluded = [&](bool elsewhere) {
    ModalDwell dwell{2, {1}, rate_hz};
    if (elsewhere) dwell.solve_elsewhere();
    dwell.know(prior_of({ringing, slow}, 0.01), {&variance, 1}, 1000.0);
    dwell.start({.omega_rad_s = two_pi * tone_hz,
                 .cycle_samples = 500,
                 .least_samples = 400,
                 .target_db = 0.005,
                 .target_deg = 0.03});
    ModalStore samples{2, 1000};
    fill(samples, tone_hz, 1e-2, 700);
    ModalSample applied;
    ModalSample read;
    for (std::uint64_t k = 0; k < samples.count(); ++k) {
      EXPECT_TRUE(samples.sample(0, k, applied) && samples.sample(1, k, read));
      const std::vector<Observation> observed{{.value = applied.value}, {.value = read.value}};
      dwell.add(read.tone, observed);
    }
    while (!dwell.concluded()) std::this_thread::yield();
    EXPECT_TRUE(dwell.live());
    EXPECT_TRUE(dwell.conclude());
    return dwell.result(0).estimate.response;
  };
  const std::complex<double> at_once = concluded(false);
  EXPECT_NEAR(std::abs(at_once - true_tone), 0.0, 0.02);
  EXPECT_EQ(concluded(true), at_once);
}

TEST(ModelTrust, DoubtsAfterTwoOfTenAndCondemnsWhatWasModelled) {
  const ModePrior used = prior_of({slow}, 0.01);
  KnownModes found;
  found.prior = prior_of({slow, ringing}, 0.01);
  ModelTrust trust{4};
  trust.dwell_ended(0, true, false);
  trust.dwell_ended(1, false, true);
  EXPECT_FALSE(trust.doubted());
  trust.dwell_ended(2, false, true);
  ASSERT_TRUE(trust.doubted());
  EXPECT_EQ(trust.probed(&found, used), ModelTrust::Judgement::replaced);
  EXPECT_EQ(trust.next_condemned(0), 0U);
  trust.acquit(0);
  EXPECT_EQ(trust.next_condemned(0), 4U);
}

TEST(ModelTrust, KeepsModesThatAreFoundAgain) {
  KnownModes found;
  found.prior = prior_of({ringing, slow}, 0.01);
  ModelTrust trust{4};
  trust.dwell_ended(0, true, false);
  trust.dwell_ended(1, false, true);
  trust.dwell_ended(2, false, true);
  EXPECT_EQ(trust.probed(&found, prior_of({slow, ringing}, 0.01)),
            ModelTrust::Judgement::confirmed);
  EXPECT_EQ(trust.next_condemned(0), 4U);
}

TEST(ModelTrust, GivesUpWhereNothingIsFound) {
  ModelTrust trust{2};
  trust.dwell_ended(0, true, false);
  trust.dwell_ended(1, false, true);
  EXPECT_EQ(trust.probed(nullptr, prior_of({slow}, 0.01)), ModelTrust::Judgement::given_up);
  EXPECT_EQ(trust.next_condemned(0), 0U);
}

SweepSettings modelled_sweep() {
  SweepSettings sweep;
  sweep.start_hz = 1.0;
  sweep.stop_hz = 100.0;
  sweep.points = 12;
  sweep.amplitude = 1.0;
  sweep.frequency_tolerance = 5e-3;
  sweep.settling = Settling::model;
  return sweep;
}

// Its chirp passes frequencies that no dwell has.
TEST(Probe, MovesNoFasterThanIsAllowed) {
  SweepSettings sweep = modelled_sweep();
  sweep.points = 1;
  sweep.start_hz = sweep.stop_hz = 10.0;
  sweep.amplitude = 0.2;
  const MotionLimits limits{.velocity_max = 13.0, .acceleration_max = 800.0};
  const Probe probe = make_probe(sweep, limits, rate_hz);
  double velocity = 0.0;
  double acceleration = 0.0;
  for (std::size_t k = 1; k + 1 < probe.command.size(); ++k) {
    const double before = probe.command[k - 1];
    const double here = probe.command[k];
    const double after = probe.command[k + 1];
    velocity = std::max(velocity, std::abs(after - before) * 0.5 * rate_hz);
    if (here != 0.0 && after != 0.0 && before != 0.0)
      acceleration =
          std::max(acceleration, std::abs(after - 2.0 * here + before) * rate_hz * rate_hz);
  }
  EXPECT_LE(velocity, 1.02 * limits.velocity_max);
  EXPECT_LE(acceleration, 1.1 * limits.acceleration_max);
}

TEST(Probe, BeginsAsQuietlyAsALevelledSweep) {
  SweepSettings sweep = modelled_sweep();
  sweep.level = {.response = 0.1, .most_response = 0.3, .least_amplitude = 0.05};
  const Probe probe = make_probe(sweep, {}, rate_hz);
  EXPECT_NEAR(*std::max_element(probe.command.begin(), probe.command.end()), 0.05, 1e-3);
}

TEST(Probe, StaysWithinTheLimitsAndEndsAtRest) {
  const MotionLimits limits{.command_min = -0.5, .command_max = 0.8, .slew_per_s = 400.0};
  const Probe probe = make_probe(modelled_sweep(), limits, rate_hz);
  ASSERT_EQ(probe.command.size(), 500U);
  double before = 0.0;
  for (const double command : probe.command) {
    EXPECT_LE(std::abs(command), 0.5);
    EXPECT_LE(std::abs(command - before) * rate_hz, 400.0 * (1.0 + 1e-12));
    before = command;
  }
  EXPECT_EQ(probe.command.back(), 0.0);
  EXPECT_TRUE(make_probe(SweepSettings{}, limits, rate_hz).command.empty());
}

// A whole sweep with told modes takes a fraction of the time of detection, and is as right.
TEST(ModelledSweep, EndsBeforeItsTransientsDo) {
  sim::SimulatedRigSettings rig;
  sim::MechanicalAxis axis;
  axis.inertia = 0.02;
  axis.damping = 0.1;
  axis.stiffness = 0.02 * std::pow(two_pi * 8.0, 2);
  rig.system = sim::from_mechanical_axis(axis);
  rig.sensors = {{.output = 0, .imperfections = {.noise_rms = 1e-5}}};
  const double sigma = -0.1 / 0.02 / 2.0;
  const ModePole pole{.sigma_rad_s = sigma,
                      .omega_rad_s = std::sqrt(std::pow(two_pi * 8.0, 2) - sigma * sigma)};
  RunnerSettings settings;
  settings.modes =
      KnownModes{.prior = prior_of({pole}, 0.01), .noise_variance = {1e-10}, .noise_dof = 100.0};
  SweepSettings sweep = modelled_sweep();
  const test::VirtualRun modelled =
      test::run_virtual(plan_sweep(sweep, {}, rate_hz), rig, test::open_guard(1), settings);
  sweep.settling = Settling::detect;
  const test::VirtualRun detected = test::run_virtual(plan_sweep(sweep, {}, rate_hz), rig);
  ASSERT_EQ(modelled.sink.points.size(), 12U);
  EXPECT_LT(static_cast<double>(modelled.outcome.ticks),
            0.7 * static_cast<double>(detected.outcome.ticks));
  for (std::size_t i = 0; i < 12; ++i) {
    const Point& one = modelled.sink.points[i];
    const Point& other = detected.sink.points[i];
    EXPECT_EQ(one.status, PointStatus::good) << i;
    EXPECT_NEAR(std::abs(one.response / other.response - 1.0), 0.0, 0.02) << i;
  }
}

}  // namespace
}  // namespace sinerig
