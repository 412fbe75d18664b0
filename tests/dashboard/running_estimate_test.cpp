#include "dashboard/running_estimate.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "support/parameters.h"

namespace sinerig::dashboard {
namespace {

Block block_of(std::uint32_t number, std::uint16_t channel, std::complex<double> phasor,
               std::uint32_t attempt = 0) {
  return {.dwell = 0,
          .attempt = attempt,
          .block = number,
          .tone = 0,
          .channel = channel,
          .first_tick = 0,
          .coefficients = {.a = phasor.imag(), .b = phasor.real(), .mean = 0.0}};
}

void add(RunningEstimate& estimate, std::uint32_t number, std::complex<double> input,
         std::complex<double> output, std::uint32_t attempt = 0) {
  estimate.add(block_of(number, 1, input, attempt));
  estimate.add(block_of(number, 2, output, attempt));
  estimate.add(block_of(number, 3, {99.0, 99.0}, attempt));
}

TEST(RunningEstimate, SaysNothingBeforeABlockIsWhole) {
  RunningEstimate estimate{1, 2};
  EXPECT_FALSE(estimate.value());
  estimate.add(block_of(0, 1, {0.5, 0.0}));
  EXPECT_FALSE(estimate.value());
  estimate.add(block_of(0, 2, {0.0, -1.0}));
  const auto value = estimate.value();
  ASSERT_TRUE(value);
  EXPECT_EQ(value->response, std::complex<double>(0.0, -2.0));
  EXPECT_TRUE(std::isnan(value->gain_interval_db));
}

TEST(RunningEstimate, LeavesTheTransientBehind) {
  RunningEstimate estimate{1, 2};
  const std::complex<double> wanted{0.3, -0.4};
  for (std::uint32_t i = 0; i < 40; ++i)
    add(estimate, i, {2.0, 0.0}, 2.0 * wanted * (1.0 + std::exp(-static_cast<double>(i))));
  EXPECT_LT(std::abs(estimate.value()->response / wanted - 1.0), 1e-8);
}

TEST(RunningEstimate, BeginsAnewWithEachAttempt) {
  RunningEstimate estimate{1, 2};
  for (std::uint32_t i = 0; i < 4; ++i) add(estimate, i, {1.0, 0.0}, {5.0, 0.0});
  add(estimate, 0, {1.0, 0.0}, {7.0, 0.0}, 1);
  EXPECT_EQ(estimate.value()->response, std::complex<double>(7.0, 0.0));
  EXPECT_EQ(estimate.value()->blocks, 1U);
}

TEST(RunningEstimate, KeepsToItsTone) {
  RunningEstimate second{1, 2, 1};
  add(second, 0, {1.0, 0.0}, {5.0, 0.0});
  EXPECT_FALSE(second.value());
  for (const std::uint16_t channel : {std::uint16_t{1}, std::uint16_t{2}}) {
    Block block = block_of(0, channel, {channel == 1 ? 0.5 : 1.5, 0.0});
    block.tone = 1;
    second.add(block);
  }
  EXPECT_EQ(second.value()->response, std::complex<double>(3.0, 0.0));
}

// 95 % intervals hold the truth in 95 % of the cases: within 4 standard deviations of that count.
TEST(RunningEstimate, IntervalCoversTheTruth) {
  std::mt19937_64 random{test::seed(11)};
  std::normal_distribution<double> noise{0.0, 0.05};
  const std::complex<double> wanted{0.6, -0.8};
  const auto trials = static_cast<double>(test::count(4000));
  double gain_held = 0.0;
  double phase_held = 0.0;
  for (double trial = 0.0; trial < trials; ++trial) {
    RunningEstimate estimate{1, 2};
    for (std::uint32_t i = 0; i < 12; ++i)
      add(estimate, i, {1.0, 0.0}, wanted + std::complex<double>{noise(random), noise(random)});
    const auto value = estimate.value();
    const std::complex<double> ratio = value->response / wanted;
    gain_held +=
        std::abs(20.0 * std::log10(std::abs(ratio))) <= value->gain_interval_db ? 1.0 : 0.0;
    phase_held += std::abs(std::arg(ratio)) * 57.29577951 <= value->phase_interval_deg ? 1.0 : 0.0;
  }
  const double allowed = 4.0 * std::sqrt(0.95 * 0.05 / trials);
  EXPECT_NEAR(gain_held / trials, 0.95, allowed);
  EXPECT_NEAR(phase_held / trials, 0.95, allowed);
}

}  // namespace
}  // namespace sinerig::dashboard
