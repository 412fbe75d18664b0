#include "identify/hold.h"

#include <cmath>
#include <numbers>
#include <stdexcept>

#include <gtest/gtest.h>

#include "plants.h"

namespace sinerig::identify {
namespace {

using namespace test;
using Complex = std::complex<double>;

Complex held_at(const ZerosPolesGain& plant, double period_s, double omega) {
  return held_response(plant, period_s, Eigen::ArrayXd::Constant(1, omega))[0];
}

TEST(Hold, OfALagIsTheTextbookPulseTransferFunction) {
  const ZerosPolesGain lag{{}, {-3.0}, 3.0, 0.0};
  const double T = 0.1;
  const double decay = std::exp(-0.3);
  for (const double omega : {0.5, 5.0, 30.0}) {
    const Complex z = std::polar(1.0, omega * T);
    EXPECT_LT(std::abs(held_at(lag, T, omega) - (1.0 - decay) / (z - decay)), 1e-15);
  }
}

TEST(Hold, OfADoubleIntegratorIsTheTextbookPulseTransferFunction) {
  const ZerosPolesGain plant{{}, {0.0, 0.0}, 1.0, 0.0};
  const double T = 0.2;
  for (const double omega : {0.5, 5.0, 15.0}) {
    const Complex z = std::polar(1.0, omega * T);
    const Complex expected = 0.5 * T * T * (z + 1.0) / ((z - 1.0) * (z - 1.0));
    EXPECT_LT(std::abs(held_at(plant, T, omega) / expected - 1.0), 1e-12);
  }
}

TEST(Hold, DelaysByWholeAndPartTicks) {
  const ZerosPolesGain lag{{}, {-3.0}, 3.0, 0.0};
  ZerosPolesGain delayed = lag;
  const double T = 0.1;
  delayed.delay_s = 0.3;
  for (const double omega : {0.5, 5.0, 30.0})
    EXPECT_LT(std::abs(held_at(delayed, T, omega) / held_at(lag, T, omega) -
                       std::polar(1.0, -0.3 * omega)),
              1e-13);
  // 0.04 s: y[n] = (1 − e^−0.18) u[n−1] + e^−0.18(1 − e^−0.12) u[n−2] + e^−0.3 y[n−1].
  delayed.delay_s = 0.04;
  for (const double omega : {0.5, 5.0, 30.0}) {
    const Complex back = std::polar(1.0, -omega * T);
    const Complex expected =
        back * (1.0 - std::exp(-0.18) + std::exp(-0.18) * (1.0 - std::exp(-0.12)) * back) /
        (1.0 - std::exp(-0.3) * back);
    EXPECT_LT(std::abs(held_at(delayed, T, omega) - expected), 1e-14);
  }
}

TEST(Hold, IsTheSumOverTheImagesOfTheSpectrum) {
  const ZerosPolesGain plant = gimbal_b();
  const double T = 1e-3;
  for (const double omega : {10.0, 500.0, 1800.0}) {
    Complex sum = 0.0;
    for (int image = -20000; image <= 20000; ++image) {
      const Complex s{0.0, omega + 2.0 * std::numbers::pi * image / T};
      sum += plant.at(s) / (s * T);
    }
    const Complex expected = sum * (1.0 - std::polar(1.0, -omega * T));
    EXPECT_LT(std::abs(held_at(plant, T, omega) / expected - 1.0), 1e-9);
  }
}

TEST(Hold, DividedOutLeavesTheStatedErrorBelowATenthOfTheRate) {
  const double T = 1e-3;
  const double omega = 2.0 * std::numbers::pi * 100.0;
  const auto error = [&](const ZerosPolesGain& plant) {
    return std::abs(held_at(plant, T, omega) / (plant.at(omega) * hold_factor(omega, T)) - 1.0);
  };
  EXPECT_LE(error({{}, {0.0}, 1.0, 0.0}), 0.034);
  EXPECT_LE(error({{}, {0.0, 0.0}, 1.0, 0.0}), 0.0034);
  EXPECT_LE(error({{}, {0.0, 0.0, 0.0}, 1.0, 0.0}), 0.0004);
}

TEST(Hold, RefusesWhatCannotBeHeld) {
  const Eigen::ArrayXd omega = Eigen::ArrayXd::Ones(1);
  EXPECT_THROW(held_response({{-1.0}, {}, 1.0, 0.0}, 0.1, omega), std::invalid_argument);
  EXPECT_THROW(held_response({{}, {-1.0}, 1.0, 0.0}, 0.0, omega), std::invalid_argument);
  EXPECT_THROW(held_response({{}, {0.0, 0.0, 0.0, 0.0}, 1.0, 0.0}, 0.1, omega),
               std::invalid_argument);
}

}  // namespace
}  // namespace sinerig::identify
