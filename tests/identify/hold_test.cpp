#include "identify/hold.h"

#include <cmath>
#include <numbers>
#include <stdexcept>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "identify/hold_model.h"
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

// exp(p·T) of a fast growing pole is beyond any number; the response is not.
TEST(Hold, IsFiniteForAnyPole) {
  for (const double pole : {-1e9, -1e5, 1e5, 1e9})
    for (const double delay_s : {0.0, 0.04, 0.3}) {
      const ZerosPolesGain plant{{}, {-3.0, pole}, 3.0 * std::abs(pole), delay_s};
      for (const double omega : {0.5, 5.0, 30.0}) {
        const Complex held = held_at(plant, 0.1, omega);
        ASSERT_TRUE(std::isfinite(std::abs(held))) << pole;
        ZerosPolesGain slow{{}, {-3.0}, pole < 0.0 ? 3.0 : -3.0, delay_s};
        EXPECT_LT(std::abs(held / held_at(slow, 0.1, omega) - 1.0), 1e-3) << pole << ' ' << delay_s;
      }
    }
}

// Each column of the sensitivity against a central difference of the response.
TEST(Hold, HasItsSensitivityInClosedForm) {
  const double period_s = 1e-3;
  const auto grid = log_grid(2.0 * std::numbers::pi, 2.0 * std::numbers::pi * 450.0, 40);
  FitData data;
  data.omega = Eigen::Map<const Eigen::ArrayXd>(grid.data(), 40);
  data.scale = std::sqrt(grid.front() * grid.back());
  data.x = data.omega / data.scale;
  const Eigen::ArrayXd weight = Eigen::ArrayXd::Ones(40);
  const OrthonormalBasis N_basis(data.x, weight, 2);
  const OrthonormalBasis D_basis(data.x, weight, 3);
  const Eigen::VectorXd n = Eigen::Vector3d(1.0, -0.4, 0.3);
  for (const double last : {0.2, -0.3}) {  // without and with a pole that grows
    const Eigen::VectorXd d = Eigen::Vector4d(0.8, 0.5, 0.7, last);
    for (const ZerosPolesGain& fixed :
         {ZerosPolesGain{{}, {}, 1.0, 0.0}, ZerosPolesGain{{}, {0.0}, 2.0, 0.3e-3},
          ZerosPolesGain{{}, {0.0, 0.0, -300.0}, -5.0, 2.4e-3},
          ZerosPolesGain{{0.0}, {-2000.0}, 1.0, 0.0},
          ZerosPolesGain{{0.0, 0.0}, {-2000.0, -500.0}, 1.0, 0.0}}) {
      const HoldModel hold(period_s, fixed);
      const double delay_s = 0.25e-3;
      const auto closed = hold.sensitivity(N_basis, n, D_basis, d, delay_s, data);
      ASSERT_TRUE(closed);
      for (Eigen::Index column = 0; column < 8; ++column) {
        const auto moved = [&](double by) {
          Eigen::VectorXd n_moved = n;
          Eigen::VectorXd d_moved = d;
          if (column < 3) n_moved[column] += by;
          if (column >= 3 && column < 7) d_moved[column - 3] += by;
          return hold.response(N_basis, n_moved, D_basis, d_moved,
                               delay_s + (column == 7 ? by / data.scale : 0.0), data);
        };
        const Eigen::ArrayXcd difference = (moved(1e-6) - moved(-1e-6)) / 2e-6;
        EXPECT_LT((closed->col(column).array() - difference).abs().maxCoeff(),
                  1e-6 * difference.abs().maxCoeff())
            << "column " << column << ", " << fixed.poles.size() << " poles given, " << last;
      }
    }
  }
}

TEST(Hold, LeavesSensitivityToDifferencesWherePolesMeet) {
  const auto grid = log_grid(1.0, 100.0, 20);
  FitData data;
  data.omega = Eigen::Map<const Eigen::ArrayXd>(grid.data(), 20);
  data.scale = 10.0;
  data.x = data.omega / data.scale;
  const OrthonormalBasis basis(data.x, Eigen::ArrayXd::Ones(20), 1);
  const Eigen::VectorXd d =
      basis.power_coefficients().transpose().inverse() * Eigen::Vector2d(1.0, 1.0);  // 1 + x
  const Eigen::VectorXd one = Eigen::VectorXd::Unit(2, 0);
  EXPECT_TRUE(
      HoldModel(0.01, {{}, {-11.0}, 1.0, 0.0}).sensitivity(basis, one, basis, d, 0.0, data));
  EXPECT_FALSE(
      HoldModel(0.01, {{}, {-10.001}, 1.0, 0.0}).sensitivity(basis, one, basis, d, 0.0, data));
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
