#include "sweep/tone.h"

#include <cmath>
#include <numbers>
#include <numeric>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

#include "support/parameters.h"

namespace sinerig {
namespace {

__extension__ using Wide = unsigned __int128;

TEST(Snap, KeepsAFrequencyThatIsAlreadyCoherent) {
  EXPECT_EQ(snap(10.0, 1000.0, 1e-9), (CoherentFrequency{.cycles = 1, .samples = 100}));
  EXPECT_EQ(snap(400.0, 1000.0, 1e-9), (CoherentFrequency{.cycles = 2, .samples = 5}));
}

TEST(Snap, StaysWithinItsToleranceInLowestTermsWithTheFewestSamples) {
  std::mt19937_64 random{test::seed(1)};
  std::uniform_real_distribution<double> log_ratio{std::log(1e-5), std::log(0.4999)};
  std::uniform_real_distribution<double> log_tolerance{std::log(1e-8), std::log(0.1)};
  for (std::uint64_t i = 0; i < test::count(3000); ++i) {
    const double ratio = std::exp(log_ratio(random));
    const double tolerance = std::exp(log_tolerance(random));
    const CoherentFrequency snapped = snap(ratio * 777.0, 777.0, tolerance);
    SCOPED_TRACE(testing::Message() << "ratio " << ratio << ", tolerance " << tolerance);
    ASSERT_GT(snapped.cycles, 0U);
    ASSERT_LT(2 * snapped.cycles, snapped.samples);
    ASSERT_EQ(std::gcd(snapped.cycles, snapped.samples), 1U);
    ASSERT_NEAR(snapped.hz(777.0) / (ratio * 777.0), 1.0, tolerance * (1.0 + 1e-6));
    // No fraction with fewer samples lies in the interval (less the rounding of its ends).
    const long double low = static_cast<long double>(ratio) * (1.0L - tolerance) * (1.0L + 1e-14L);
    const long double high = static_cast<long double>(ratio) * (1.0L + tolerance) * (1.0L - 1e-14L);
    for (std::uint64_t samples = 3; samples < std::min<std::uint64_t>(snapped.samples, 5000);
         ++samples) {
      const long double cycles = std::ceil(low * static_cast<long double>(samples));
      const bool inside = cycles <= high * static_cast<long double>(samples) &&
                          2.0L * cycles < static_cast<long double>(samples);
      ASSERT_FALSE(inside) << cycles << "/" << samples << " is simpler than " << snapped.cycles
                           << "/" << snapped.samples;
    }
  }
}

TEST(Snap, RefusesWhatLiesOutsideOfTheBandByMessage) {
  const auto message_of = [](double frequency_hz, double tolerance) -> std::string {
    try {
      snap(frequency_hz, 100.0, tolerance);
    } catch (const std::invalid_argument& refused) {
      return refused.what();
    }
    return "";
  };
  for (const double frequency_hz : {0.0, -1.0, 50.0, 60.0, std::nan("")}) {
    EXPECT_EQ(message_of(frequency_hz, 1e-3),
              "snap: the frequency must be above 0 and below half the rate");
  }
  for (const double tolerance : {0.0, -1e-3, 0.11, std::nan("")}) {
    EXPECT_EQ(message_of(10.0, tolerance), "snap: the tolerance must be in (0, 0.1]");
  }
}

TEST(Phasor, IsWithinTwoUnitsInTheLastPlaceEverywhere) {
  for (const std::uint64_t samples : {3U, 7U, 8U, 100U, 12'347U}) {
    for (std::uint64_t index = 0; index < samples; ++index) {
      const long double angle = 2.0L * std::numbers::pi_v<long double> *
                                static_cast<long double>(index) / static_cast<long double>(samples);
      const Phasor at = phasor(index, samples);
      ASSERT_NEAR(at.cosine, static_cast<double>(std::cos(angle)), 2.3e-16);
      ASSERT_NEAR(at.sine, static_cast<double>(std::sin(angle)), 2.3e-16);
    }
  }
}

TEST(Phasor, IsSymmetricToTheBit) {
  constexpr std::uint64_t samples = 1000;
  for (std::uint64_t index = 1; index < samples / 2; ++index) {
    const Phasor at = phasor(index, samples);
    const Phasor opposite = phasor(index + samples / 2, samples);
    const Phasor mirrored = phasor(samples - index, samples);
    EXPECT_EQ(at.cosine, -opposite.cosine);
    EXPECT_EQ(at.sine, -opposite.sine);
    EXPECT_EQ(at.cosine, mirrored.cosine);
    EXPECT_EQ(at.sine, -mirrored.sine);
  }
}

TEST(PhaseCounter, IsExactAfterABillionTicksOfAnyLength) {
  std::mt19937_64 random{test::seed(2)};
  constexpr std::uint64_t longest_block = 2'600'000'000;
  for (std::uint64_t i = 0; i < test::count(200); ++i) {
    const std::uint64_t samples =
        std::uniform_int_distribution<std::uint64_t>{3, longest_block}(random);
    const std::uint64_t cycles = std::uniform_int_distribution<std::uint64_t>{1, samples}(random);
    PhaseCounter phase{cycles, samples};
    std::uint64_t ticks = 0;
    while (ticks < 1'000'000'000) {
      const bool gap = random() % 2 == 0;
      const std::uint64_t jump = gap ? random() % 10'000'000 : 1;
      phase.advance(jump);
      ticks += jump;
      ASSERT_EQ(phase.index(), static_cast<std::uint64_t>(Wide{cycles} * ticks % samples));
    }
  }
}

TEST(PhaseCounter, ComesRoundToZeroAfterEveryBlock) {
  PhaseCounter phase{7, 1250};
  for (int block = 0; block < 1000; ++block) {
    EXPECT_EQ(phase.index(), 0U);
    for (int tick = 0; tick < 1250; ++tick) phase.advance(1);
  }
}

}  // namespace
}  // namespace sinerig
