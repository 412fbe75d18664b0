// The regression at true sample times: what it must equal, and what it must not mind.
#include "sweep/regression.h"

#include <cmath>
#include <complex>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "sweep/estimator.h"
#include "sweep/tone.h"

namespace sinerig {
namespace {

constexpr double rate_hz = 1000.0;
constexpr CoherentFrequency tone{.cycles = 3, .samples = 250};
constexpr double omega = 2.0 * std::numbers::pi * 12.0;
constexpr int blocks = 8;

// y = mean + drift t + a cos ωt + b sin ωt at time t.
struct Signal {
  double mean = 0.3;
  double drift_per_s = 0.0;
  double a = 0.7;
  double b = -0.4;

  double at(double time_s) const {
    return mean + drift_per_s * time_s + a * std::cos(omega * time_s) +
           b * std::sin(omega * time_s);
  }
};

struct Faults {
  double lost_fraction = 0.0;
  double jitter_s = 0.0;
  double age_s = 0.0;
};

struct Outcome {
  std::complex<double> regressed;
  std::complex<double> summed;  // the plain sums over whatever arrived, as if on time
};

// Input: the exact sine. Output: `signal`, with `faults`.
Outcome measure(const Signal& signal, const Faults& faults, std::uint64_t seed) {
  std::mt19937_64 generator{seed};
  std::uniform_real_distribution<double> uniform;
  Regression regression{2, 1, 33, 1};
  regression.start(std::span{&omega, 1}, 1.0 / rate_hz, 250.0, 1);
  PhaseCounter phase{tone.cycles, tone.samples};
  Outcome outcome;
  double last = 0.0;
  for (int n = 0; n < blocks * 250; ++n) {
    const Phasor phasor = phase.phasor();
    const double age_s = faults.age_s + faults.jitter_s * (uniform(generator) - 0.5);
    const auto offset_ns = static_cast<std::int64_t>(std::llround(-age_s * 1e9));
    const double true_time_s = n / rate_hz + static_cast<double>(offset_ns) * 1e-9;
    const bool lost = uniform(generator) < faults.lost_fraction;
    const double value = lost ? last : signal.at(true_time_s);
    last = value;
    const Observation observations[] = {{.value = phasor.sine},
                                        {.value = value, .offset_ns = offset_ns, .missing = lost}};
    regression.add({&phasor, 1}, observations);
    outcome.summed +=
        std::complex<double>{value * phasor.sine, value * phasor.cosine} * (2.0 / (blocks * 250));
    if ((n + 1) % 250 == 0) regression.checkpoint();
    phase.advance(1);
  }
  WindowEstimator estimator{1};
  Estimate estimate;
  const Window window{.first = 0, .last = regression.checkpoints() - 1, .cluster = 1};
  EXPECT_TRUE(estimator.estimate(regression, window, {}, std::span{&omega, 1}, 0, {&estimate, 1}));
  outcome.regressed = estimate.response;
  return outcome;
}

double error(std::complex<double> measured, const Signal& signal) {
  const std::complex<double> exact{signal.b, signal.a};
  return std::abs(measured - exact) / std::abs(exact);
}

TEST(Regression, EqualsThePlainSumsOnCompleteUniformBlocks) {
  const Signal signal;
  const Outcome outcome = measure(signal, {}, 1);
  EXPECT_LT(std::abs(outcome.regressed - outcome.summed), 1e-12);
  EXPECT_LT(error(outcome.regressed, signal), 1e-12);
}

TEST(Regression, DoesNotMindLostSamples) {
  const Signal signal;
  const Outcome outcome = measure(signal, {.lost_fraction = 0.05}, 2);
  EXPECT_LT(error(outcome.regressed, signal), 1e-9);
  EXPECT_GT(error(outcome.summed, signal), 1e-4);
}

TEST(Regression, DoesNotMindJitteredSampleTimes) {
  const Signal signal;
  const Outcome outcome = measure(signal, {.jitter_s = 1e-4}, 3);
  EXPECT_LT(error(outcome.regressed, signal), 1e-9);
  EXPECT_GT(error(outcome.summed, signal), 1e-5);
}

TEST(Regression, DoesNotMindDrift) {
  // Ten amplitudes a block.
  const Signal signal{.drift_per_s = 10.0 * std::hypot(0.7, 0.4) / 0.25};
  const Outcome outcome = measure(signal, {}, 4);
  EXPECT_LT(error(outcome.regressed, signal), 1e-9);
  EXPECT_GT(error(outcome.summed, signal), 0.5);
}

TEST(Regression, TakesOutTheAgeOfTheSamples) {
  const Signal signal;
  const Outcome outcome = measure(signal, {.age_s = 0.0023}, 5);
  EXPECT_LT(error(outcome.regressed, signal), 1e-9);
  EXPECT_GT(error(outcome.summed, signal), 0.1);
}

TEST(Regression, MergesCheckpointsWithoutLosingTheWindow) {
  const Signal signal;
  Regression few{2, 1, 5, 1};
  few.start(std::span{&omega, 1}, 1.0 / rate_hz, 250.0, 1);
  PhaseCounter phase{tone.cycles, tone.samples};
  for (int n = 0; n < 32 * 250; ++n) {
    const Phasor phasor = phase.phasor();
    const Observation observations[] = {{.value = phasor.sine}, {.value = signal.at(n / rate_hz)}};
    few.add({&phasor, 1}, observations);
    if ((n + 1) % 250 == 0) few.checkpoint();
    phase.advance(1);
  }
  EXPECT_EQ(few.stride(), 8U);
  EXPECT_EQ(few.samples_at(few.checkpoints() - 1), 32U * 250U);
  WindowEstimator estimator{1};
  Estimate estimate;
  ASSERT_TRUE(estimator.estimate(few, {.first = 0, .last = few.checkpoints() - 1}, {},
                                 std::span{&omega, 1}, 0, {&estimate, 1}));
  EXPECT_LT(error(estimate.response, signal), 1e-12);
}

}  // namespace
}  // namespace sinerig
