// Modes from a short record: the poles that the record was made with come back.
#include "identify/transient_modes.h"

#include <cmath>
#include <complex>
#include <numbers>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sinerig::identify {
namespace {

constexpr double period_s = 1e-3;
constexpr double two_pi = 2.0 * std::numbers::pi;
const std::complex<double> ringing{-0.6, two_pi * 23.0};
const std::complex<double> slow{-5.0, 0.0};

// A chirp through a pair and a real pole with 1.4 ticks of dead time, from rest, plus noise.
MotionRecord record_of(double noise_rms) {
  MotionRecord record{.period_s = period_s, .input = {}, .output = {}};
  std::mt19937_64 random{3};
  std::normal_distribution<double> noise{0.0, 1.0};
  std::complex<double> pair = 0.0;
  double real = 0.0;
  double phase = 0.0;
  std::vector<double> late(3, 0.0);
  for (int k = 0; k < 1000; ++k) {
    const double hz = 0.5 * std::pow(400.0, k / 1000.0);
    const double u = k < 100 ? 0.0 : std::sin(phase);
    phase += two_pi * hz * period_s;
    late[static_cast<std::size_t>(k % 3)] = u;
    const double one = late[static_cast<std::size_t>((k + 2) % 3)];
    const double two = late[static_cast<std::size_t>((k + 1) % 3)];
    const double driven = 0.6 * one + 0.4 * two;
    record.input.push_back(u);
    record.output.push_back(pair.real() + 2.0 * real + noise_rms * noise(random));
    const std::complex<double> z = std::exp(ringing * period_s);
    pair = z * pair + (1.0 - z) * driven;
    const double decay = std::exp(slow.real() * period_s);
    real = decay * real + (1.0 - decay) * driven;
  }
  return record;
}

TEST(FindModes, FindsOrderAndPolesWithinTheirErrors) {
  const FoundModes found = find_modes(record_of(1e-3), {.lowest_hz = 0.5, .highest_hz = 400.0});
  ASSERT_EQ(found.poles.size(), 2U);
  const bool real_first = found.poles[0].imag() == 0.0;
  const std::complex<double> pair = found.poles[real_first ? 1 : 0];
  const std::complex<double> real = found.poles[real_first ? 0 : 1];
  const Eigen::Index pair_row = real_first ? 1 : 0;
  const Eigen::Index real_row = real_first ? 0 : 2;
  EXPECT_NEAR(pair.real(), ringing.real(), 4.0 * std::sqrt(found.covariance(pair_row, pair_row)));
  EXPECT_NEAR(pair.imag(), ringing.imag(),
              4.0 * std::sqrt(found.covariance(pair_row + 1, pair_row + 1)));
  EXPECT_NEAR(real.real(), slow.real(), 4.0 * std::sqrt(found.covariance(real_row, real_row)));
  EXPECT_NEAR(std::sqrt(found.noise_variance), 1e-3, 1e-4);
}

TEST(FindModes, TakesARecordWithLostSamples) {
  MotionRecord record = record_of(1e-3);
  for (std::size_t k = 7; k < record.output.size(); k += 50) record.output[k] = std::nan("");
  const FoundModes found = find_modes(record, {.lowest_hz = 0.5, .highest_hz = 400.0});
  ASSERT_EQ(found.poles.size(), 2U);
  for (const auto& pole : found.poles) {
    const std::complex<double> truth = pole.imag() == 0.0 ? slow : ringing;
    EXPECT_LT(std::abs(pole - truth), 0.02 * std::abs(truth));
  }
}

TEST(FindModes, RefusesWhatIsNoRecord) {
  const auto refusal = [](const MotionRecord& record) -> std::string {
    try {
      find_modes(record, {.lowest_hz = 1.0, .highest_hz = 100.0});
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  using testing::HasSubstr;
  EXPECT_THAT(refusal({.period_s = 1e-3, .input = {1.0}, .output = {}}),
              HasSubstr("1 inputs and 0 outputs"));
  EXPECT_THAT(refusal({.period_s = 1e-3, .input = {1.0, 2.0}, .output = {1.0, 2.0}}),
              HasSubstr("modes need 100 at least"));
  const std::vector<double> still(200, 0.5);
  EXPECT_THAT(refusal({.period_s = 1e-3, .input = still, .output = still}),
              HasSubstr("nothing was excited"));
}

}  // namespace
}  // namespace sinerig::identify
