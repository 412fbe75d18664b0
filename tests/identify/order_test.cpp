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
