#include "sim/imperfections.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "support/parameters.h"

namespace sinerig::sim {
namespace {

// Exponent γ of a spectrum 1/f^γ: the variance of the details of an orthonormal Haar transform
// grows by 2^γ from one octave to the next lower.
double spectral_exponent(std::vector<double> signal, int first_octave, int last_octave) {
  std::vector<double> log_variance;
  for (int octave = 1; octave <= last_octave; ++octave) {
    std::vector<double> smooth(signal.size() / 2);
    double power = 0.0;
    for (std::size_t i = 0; i < smooth.size(); ++i) {
      smooth[i] = (signal[2 * i] + signal[2 * i + 1]) / std::sqrt(2.0);
      const double detail = (signal[2 * i] - signal[2 * i + 1]) / std::sqrt(2.0);
      power += detail * detail;
    }
    if (octave >= first_octave) {
      log_variance.push_back(std::log2(power / static_cast<double>(smooth.size())));
    }
    signal = std::move(smooth);
  }
  // Least-squares slope over the octaves.
  const auto n = static_cast<double>(log_variance.size());
  double slope = 0.0;
  double spread = 0.0;
  for (std::size_t i = 0; i < log_variance.size(); ++i) {
    const double x = static_cast<double>(i) - (n - 1.0) / 2.0;
    slope += x * log_variance[i];
    spread += x * x;
  }
  return slope / spread;
}

TEST(PinkNoise, HasASpectrumThatFallsAsOneOverTheFrequency) {
  PinkNoise pink{1.0, test::seed(7)};
  std::vector<double> signal(1U << 18U);
  for (double& value : signal) value = pink.next();
  EXPECT_NEAR(spectral_exponent(signal, 3, 11), 1.0, 0.1);
}

TEST(SpectralExponent, OfWhiteNoiseIsZero) {
  std::mt19937_64 generator{test::seed(8)};
  std::normal_distribution<double> normal;
  std::vector<double> signal(1U << 18U);
  for (double& value : signal) value = normal(generator);
  EXPECT_NEAR(spectral_exponent(signal, 3, 11), 0.0, 0.1);
}

TEST(PinkNoise, HasTheRmsThatWasAskedForFromTheFirstSampleOn) {
  double power = 0.0;
  constexpr std::uint64_t seeds = 4000;
  for (std::uint64_t seed = 0; seed < seeds; ++seed) {
    PinkNoise pink{0.3, seed};
    const double value = pink.next();
    power += value * value;
  }
  EXPECT_NEAR(std::sqrt(power / seeds), 0.3, 0.3 * 0.05);
}

TEST(Backlash, FollowsOnlyOnceTheGapIsCrossed) {
  Backlash play{0.2};
  EXPECT_DOUBLE_EQ(play.pass(0.05), 0.0);
  EXPECT_DOUBLE_EQ(play.pass(0.5), 0.4);
  EXPECT_DOUBLE_EQ(play.pass(0.35), 0.4);  // inside of the gap
  EXPECT_DOUBLE_EQ(play.pass(0.3), 0.4);   // at its other side
  EXPECT_DOUBLE_EQ(play.pass(0.1), 0.2);
  EXPECT_DOUBLE_EQ(play.pass(-1.0), -0.9);
}

TEST(Quantiser, RoundsToTheNearestStepAndIsOffAtZero) {
  EXPECT_DOUBLE_EQ(quantise(0.34, 0.1), 0.3);
  EXPECT_DOUBLE_EQ(quantise(0.36, 0.1), 0.4);
  EXPECT_DOUBLE_EQ(quantise(-0.36, 0.1), -0.4);
  EXPECT_EQ(quantise(0.123456, 0.0), 0.123456);
}

TEST(StreamSeeds, DifferBetweenStreamsAndSeeds) {
  std::vector<std::uint64_t> seeds;
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    for (std::uint64_t stream = 0; stream < 50; ++stream) {
      seeds.push_back(stream_seed(seed, stream));
    }
  }
  std::sort(seeds.begin(), seeds.end());
  EXPECT_EQ(std::adjacent_find(seeds.begin(), seeds.end()), seeds.end());
}

}  // namespace
}  // namespace sinerig::sim
