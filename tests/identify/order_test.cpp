#include "identify/order.h"

#include <cmath>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

#include "plants.h"

namespace sinerig::identify {
namespace {

using namespace test;
using Random = std::mt19937_64;

TEST(Order, IsFoundForTheExampleOfThePaper) {
  Random random(1);
  const Response response = noisy_response(choe_example_3(), choe_grid(), 0.01, random);
  const OrderSelection selection = select_order(response, {});
  EXPECT_EQ(selection.chosen.poles, 3);
  EXPECT_EQ(selection.chosen.zeros, 0);
  EXPECT_EQ(selection.chosen.origin, 0);
  EXPECT_TRUE(selection.table.front().explained);
  for (std::size_t i = 1; i < selection.table.size(); ++i)
    EXPECT_GE(selection.table[i].criterion, selection.table[i - 1].criterion);
}

TEST(Order, IsFoundForAGimbalWithUnknownDelay) {
  Random random(2);
  const Response response = noisy_response(gimbal_b(), gimbal_grid(), 0.01, random);
  OrderSettings settings;
  settings.fit.delay = Delay::fit;
  const OrderSelection selection = select_order(response, settings);
  EXPECT_EQ(selection.chosen.poles, 7);
  EXPECT_EQ(selection.chosen.zeros, 4);
  EXPECT_EQ(selection.chosen.origin, 1);
  EXPECT_LT(gain_error(selection.fit.zpk, gimbal_b(), gimbal_grid()).rms_db, 0.05);
}

TEST(Order, IsFoundWithoutKnowingTheScatter) {
  Random random(3);
  Response response = noisy_response(gimbal_b(), gimbal_grid(), 0.01, random);
  for (ResponsePoint& point : response) point.variance_re = point.variance_im = 0.0;
  OrderSettings settings;
  settings.fit.delay = Delay::fit;
  const OrderSelection selection = select_order(response, settings);
  EXPECT_EQ(selection.chosen.poles, 7);
  EXPECT_EQ(selection.chosen.zeros, 4);
  EXPECT_NEAR(std::sqrt(selection.fit.chi2 / selection.fit.degrees_of_freedom), 0.01, 0.002);
}

// Noise that is ten times larger here than there, as on every bench, is not followed with poles.
TEST(Order, IsFoundWithoutKnowingAScatterThatIsUneven) {
  const ZerosPolesGain motor =
      to_zeros_poles_gain({{250.0, 1875.0, 1.25e7}, {1.0, 22.5, 150062.5, 500000.0}, 0.00075});
  const std::vector<double> grid =
      log_grid(2.0 * std::numbers::pi, 2.0 * std::numbers::pi * 250.0, 50);
  OrderSettings settings;
  settings.fit.delay = Delay::fit;
  for (const double largest : {1e-3, 3e-3, 1e-2}) {
    for (unsigned seed = 1; seed <= 4; ++seed) {
      SCOPED_TRACE("largest " + std::to_string(largest) + ", seed " + std::to_string(seed));
      Random random(seed);
      std::uniform_real_distribution<double> decade(-1.0, 0.0);
      std::normal_distribution<double> normal;
      Response response = exact_response(motor, grid);
      for (ResponsePoint& point : response) {
        const double size = largest * std::pow(10.0, decade(random)) * std::abs(point.response);
        point.response += size * std::complex<double>{normal(random), normal(random)};
      }
      const OrderSelection selection = select_order(response, settings);
      EXPECT_EQ(selection.chosen.poles, 3);
      EXPECT_TRUE(selection.fit.outliers.empty());
      EXPECT_FALSE(selection.fit.scatter_known);
      EXPECT_EQ(selection.chosen.model_error, 0.0);
    }
  }
}

TEST(Order, IsExactOnExactData) {
  const OrderSelection selection = select_order(exact_response(choe_example_3(), choe_grid()), {});
  EXPECT_EQ(selection.chosen.poles, 3);
  EXPECT_EQ(selection.chosen.zeros, 0);
}

TEST(Order, IsFoundInSpiteOfOutliers) {
  Random random(4);
  Response response = noisy_response(gimbal_b(), gimbal_grid(), 0.01, random);
  for (const std::size_t i : {15U, 50U}) response[i].response *= std::complex<double>(0.4, 0.5);
  OrderSettings settings;
  settings.fit.delay = Delay::fit;
  const OrderSelection selection = select_order(response, settings);
  EXPECT_EQ(selection.chosen.poles, 7);
  EXPECT_EQ(selection.fit.outliers.size(), 2U);
}

// The motor of config/two-mass.toml falls as 1/ω: at 250 Hz of 2000 the images of the hold are 2.6
// %, which a search without them explains by a fast pole that is not there.
TEST(Order, IsFoundBehindAHoldWhoseImagesAreLarge) {
  const ZerosPolesGain motor =
      to_zeros_poles_gain({{250.0, 1875.0, 1.25e7}, {1.0, 22.5, 150062.5, 500000.0}, 0.00075});
  const double period_s = 1.0 / 2000.0;
  const std::vector<double> grid =
      log_grid(2.0 * std::numbers::pi, 2.0 * std::numbers::pi * 250.0, 50);
  for (unsigned seed = 1; seed <= 5; ++seed) {
    Random random(seed);
    const Response response = noisy_behind_hold(motor, period_s, grid, 0.002, random);
    OrderSettings settings;
    settings.fit.delay = Delay::fit;
    settings.fit.hold_period_s = period_s;
    const OrderSelection selection = select_order(response, settings);
    EXPECT_EQ(selection.chosen.poles, 3) << "seed " << seed;
    EXPECT_EQ(selection.chosen.zeros, 2) << "seed " << seed;
    EXPECT_EQ(selection.chosen.origin, 0) << "seed " << seed;
    EXPECT_LT(gain_error(selection.fit.zpk, motor, grid).rms_db, 0.02) << "seed " << seed;
  }
}

// Near half the rate the images do not settle as a correction of the data: the orders chosen
// without the hold in the model were wrong from 0.3 of the rate on, many of them unstable.
TEST(Order, IsFoundBehindAHoldNearHalfItsRate) {
  const double period_s = 1e-3;
  int number = 0;
  for (const ZerosPolesGain& plant : plain_plants()) {
    ++number;
    for (const double top_hz : {300.0, 400.0, 450.0}) {
      const std::vector<double> grid =
          log_grid(2.0 * std::numbers::pi * 0.5, 2.0 * std::numbers::pi * top_hz, 60);
      for (unsigned seed = 1; seed <= 2; ++seed) {
        SCOPED_TRACE("plant " + std::to_string(number) + " to " + std::to_string(top_hz) +
                     " Hz, seed " + std::to_string(seed));
        Random random(seed);
        OrderSettings settings;
        settings.fit.delay = Delay::fit;
        settings.fit.hold_period_s = period_s;
        const OrderSelection selection =
            select_order(noisy_behind_hold(plant, period_s, grid, 1e-3, random), settings);
        EXPECT_EQ(selection.chosen.poles, static_cast<int>(plant.poles.size()));
        EXPECT_EQ(selection.chosen.zeros, 0);
        EXPECT_EQ(selection.chosen.origin,
                  std::count(plant.poles.begin(), plant.poles.end(), std::complex<double>{}));
      }
    }
  }
}

// A dead time that is said to be none pulls poles to the right; asked for stable ones, the
// structure is chosen among those that are stable without being held so.
TEST(Order, IsChosenAmongStableModelsWhenThatIsAsked) {
  ZerosPolesGain plant{{}, {}, 1.0, 0.02};
  add_pair(plant.poles, 10.0, 0.6);
  set_static_gain(plant, 1.0);
  Random random(6);
  const std::vector<double> grid =
      log_grid(2.0 * std::numbers::pi * 0.5, 2.0 * std::numbers::pi * 50.0, 40);
  Response response = noisy_response(plant, grid, 0.003, random);
  for (ResponsePoint& point : response)
    point.response *= 1.0 - 0.01 * std::complex<double>{0.0, 1.0} / (0.1 * point.omega_rad_s + 0.3);
  OrderSettings settings;
  settings.fit.delay = Delay::none;
  settings.fit.stable = true;
  const OrderSelection selection = select_order(response, settings);
  EXPECT_FALSE(selection.table.front().at_limit);
  EXPECT_TRUE(selection.fit.converged);
  EXPECT_EQ(selection.table.front().poles, selection.chosen.poles);
  EXPECT_DOUBLE_EQ(selection.table.front().chi2, selection.fit.chi2);
  for (const std::complex<double> pole : selection.fit.zpk.poles) EXPECT_LE(pole.real(), 0.0);
}

TEST(Order, KeepsThePartsThatAreGiven) {
  Random random(5);
  const Response response = noisy_response(choe_example_3(), choe_grid(), 0.01, random);
  OrderSettings settings;
  settings.poles = 4;
  settings.zeros = 1;
  settings.origin = 0;
  const OrderSelection selection = select_order(response, settings);
  EXPECT_EQ(selection.chosen.poles, 4);
  EXPECT_EQ(selection.chosen.zeros, 1);
  EXPECT_EQ(selection.table.size(), 1U);
}

TEST(Order, RefusesTooFewPointsAndContradictions) {
  const auto response = exact_response(choe_example_3(), {1.0, 2.0});
  EXPECT_THROW(select_order(response, {}), std::invalid_argument);
  OrderSettings settings;
  settings.poles = 1;
  settings.origin = 2;
  EXPECT_THROW(select_order(exact_response(choe_example_3(), choe_grid()), settings),
               std::invalid_argument);
}

}  // namespace
}  // namespace sinerig::identify
