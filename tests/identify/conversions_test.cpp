#include <cmath>
#include <complex>
#include <numbers>
#include <stdexcept>

#include <gtest/gtest.h>

#include "identify/discrete.h"
#include "identify/hold.h"
#include "identify/sections.h"
#include "identify/state_space.h"
#include "plants.h"

namespace sinerig::identify {
namespace {

using Complex = std::complex<double>;

constexpr double turn = 2.0 * std::numbers::pi;

void expect_close(Complex value, Complex wanted, double tolerance) {
  EXPECT_LE(std::abs(value - wanted), tolerance * std::abs(wanted)) << value << " " << wanted;
}

TEST(Sections, MultiplyToTheModelAndShareItsGain) {
  ZerosPolesGain plant = test::gimbal_b();
  const auto sections = second_order_sections(plant);
  EXPECT_EQ(sections.size(), 4U);
  plant.delay_s = 0.0;
  for (const double hz : {0.1, 3.0, 18.0, 23.0, 90.0, 400.0}) {
    Complex product = 1.0;
    for (const Section& section : sections) product *= section.at({0.0, turn * hz});
    expect_close(product, plant.at(turn * hz), 1e-11);
  }
}

TEST(Sections, PutEachResonanceOnItsOwnZerosAndTheSharpestLast) {
  ZerosPolesGain plant{{}, {}, 5.0, 0.0};
  test::add_pair(plant.poles, 23.0, 0.02);
  test::add_pair(plant.poles, 90.0, 0.01);
  test::add_pair(plant.zeros, 75.0, 0.01);
  test::add_pair(plant.zeros, 18.0, 0.01);
  const auto sections = second_order_sections(plant);
  ASSERT_EQ(sections.size(), 2U);
  const auto frequency_hz = [](double square) {
    return std::sqrt(square) / turn;
  };
  EXPECT_NEAR(frequency_hz(sections[0].den[2]), 23.0, 1e-9);
  EXPECT_NEAR(frequency_hz(sections[0].num[2] / sections[0].num[0]), 18.0, 1e-9);
  EXPECT_NEAR(frequency_hz(sections[1].den[2]), 90.0, 1e-9);
  EXPECT_NEAR(sections[0].num[0] * sections[1].num[0], 5.0, 1e-12);
}

TEST(Sections, KeepEveryZeroWhereRealAndComplexOnesCompete) {
  ZerosPolesGain plant{{-3.0}, {-1.0, -2.0, -5.0}, 2.0, 0.0};
  test::add_pair(plant.zeros, 10.0, 0.1);
  const auto sections = second_order_sections(plant);
  Complex product = 1.0;
  for (const Section& section : sections) product *= section.at({0.0, 7.0});
  expect_close(product, plant.at(7.0), 1e-12);
}

TEST(Sections, RefuseWhatIsNotProperOrNotReal) {
  EXPECT_THROW(second_order_sections({{-1.0, -2.0}, {-3.0}, 1.0, 0.0}), std::invalid_argument);
  EXPECT_THROW(second_order_sections({{}, {{-1.0, 1.0}}, 1.0, 0.0}), std::invalid_argument);
}

TEST(StateSpace, HasTheResponseOfTheModelWithRepeatedPolesAndIntegrators) {
  const ZerosPolesGain repeated{{-2.0}, {0.0, 0.0, -5.0, -5.0, -5.0}, 3.0, 0.01};
  const StateSpace system = to_state_space(repeated);
  EXPECT_EQ(system.A.rows(), 5);
  for (const double omega : {0.3, 5.0, 40.0})
    expect_close(system.at(omega), repeated.at(omega), 1e-12);
  const StateSpace gimbal = to_state_space(test::gimbal_b());
  for (const double hz : {0.5, 18.0, 23.0, 200.0})
    expect_close(gimbal.at(turn * hz), test::gimbal_b().at(turn * hz), 1e-11);
}

TEST(MatrixExponential, RotatesByTheAngle) {
  Eigen::Matrix2d generator;
  generator << 0.0, -30.0, 30.0, 0.0;
  const Eigen::MatrixXd rotation = matrix_exponential(generator);
  EXPECT_NEAR(rotation(0, 0), std::cos(30.0), 1e-12);
  EXPECT_NEAR(rotation(1, 0), std::sin(30.0), 1e-12);
}

// G = a/(s + a): H = (1 − e^(−aT))/(z − e^(−aT)).
TEST(HoldEquivalent, OfAFirstOrderLagIsTheTextbooks) {
  const double pole = std::exp(-4.0 * 0.1);
  const DiscreteModel held = hold_equivalent({{}, {-4.0}, 4.0, 0.0}, 0.1);
  ASSERT_TRUE(held.zeros.empty());
  EXPECT_NEAR(held.gain, 1.0 - pole, 1e-15);
  EXPECT_NEAR(held.poles.front().real(), pole, 1e-15);
}

// 1/s² behind a hold: T²/2 (z + 1)/(z − 1)².
TEST(HoldEquivalent, OfADoubleIntegratorIsTheTextbooks) {
  const DiscreteModel held = hold_equivalent({{}, {0.0, 0.0}, 1.0, 0.0}, 0.2);
  ASSERT_EQ(held.zeros.size(), 1U);
  EXPECT_NEAR(held.zeros.front().real(), -1.0, 1e-12);
  EXPECT_NEAR(held.gain, 0.02, 1e-15);
}

// 1/s delayed by 0.3 T: (0.7 z + 0.3) T/(z (z − 1)).
TEST(HoldEquivalent, CountsAFractionOfATickExactly) {
  const DiscreteModel held = hold_equivalent({{}, {0.0}, 1.0, 1.3e-3}, 1e-3);
  EXPECT_EQ(held.delay_ticks, 1);
  const auto num = held.num();
  ASSERT_EQ(num.size(), 2U);
  EXPECT_NEAR(num[0], 0.7e-3, 1e-12);
  EXPECT_NEAR(num[1], 0.3e-3, 1e-12);
}

TEST(HoldEquivalent, AgreesWithThePartialFractionsOfTheHold) {
  const ZerosPolesGain plant = test::gimbal_b();
  const SampledStateSpace system = zero_order_hold(to_state_space(plant), 1e-3);
  const DiscreteModel roots = hold_equivalent(plant, 1e-3);
  for (const double hz : {1.0, 18.0, 23.0, 90.0, 300.0}) {
    const auto wanted = held_response(plant, 1e-3, Eigen::ArrayXd::Constant(1, turn * hz))[0];
    expect_close(system.at(turn * hz), wanted, 1e-9);
    expect_close(roots.at(turn * hz), wanted, 1e-6);
  }
}

TEST(Tustin, IsExactWhereItIsPrewarped) {
  ZerosPolesGain plant = test::gimbal_b();
  plant.delay_s = 2e-3;
  const DiscreteModel model = tustin(plant, 1e-3, turn * 23.0);
  EXPECT_EQ(model.delay_ticks, 2);
  expect_close(model.at(turn * 23.0), plant.at(turn * 23.0), 1e-9);
}

// 1/(s + 1) at T = 2: (z + 1)/(2 z).
TEST(Tustin, OfAFirstOrderLagIsTheTextbooks) {
  const DiscreteModel model = tustin({{}, {-1.0}, 1.0, 0.0}, 2.0);
  EXPECT_NEAR(model.gain, 0.5, 1e-15);
  EXPECT_NEAR(std::abs(model.poles.front()), 0.0, 1e-15);
  EXPECT_NEAR(model.zeros.front().real(), -1.0, 1e-15);
}

TEST(Matched, OfAFirstOrderLagIsTheTextbooks) {
  const DiscreteModel model = matched({{}, {-4.0}, 4.0, 0.0}, 0.1);
  EXPECT_TRUE(model.zeros.empty());
  EXPECT_NEAR(model.gain, 1.0 - std::exp(-0.4), 1e-15);
}

TEST(Matched, KeepsTheStaticGainAndPutsZerosAtMinusOne) {
  const ZerosPolesGain plant{{}, {-1.0, -2.0, -3.0}, 12.0, 0.0};
  const DiscreteModel model = matched(plant, 0.05);
  EXPECT_EQ(model.zeros.size(), 2U);
  EXPECT_NEAR(std::abs(model.at(0.0)), 2.0, 1e-12);
}

TEST(Discrete, AFractionOfATickIsAnAllpassOfThatDelay) {
  for (const double ticks : {0.3, 1.0, 1.7, 2.5}) {
    const DiscreteModel model = tustin({{}, {}, 1.0, ticks * 1e-3}, 1e-3);
    EXPECT_NEAR(std::abs(model.at(turn * 200.0)), 1.0, 1e-12);
    EXPECT_NEAR(-std::arg(model.at(turn)) / turn, ticks * 1e-3, 1e-8) << ticks;
    for (const Complex pole : model.poles) EXPECT_LT(std::abs(pole), 1.0);
  }
}

TEST(Discrete, RefusesWhatHasNoEquivalent) {
  const ZerosPolesGain lag{{}, {-1.0}, 1.0, 0.0};
  EXPECT_THROW(tustin(lag, 0.0), std::invalid_argument);
  EXPECT_THROW(tustin(lag, 0.1, 40.0), std::invalid_argument);
  EXPECT_THROW(matched({{-1.0}, {}, 1.0, 0.0}, 0.1), std::invalid_argument);
  EXPECT_THROW(hold_equivalent({{}, {-1.0}, 1.0, -0.1}, 0.1), std::invalid_argument);
}

}  // namespace
}  // namespace sinerig::identify
