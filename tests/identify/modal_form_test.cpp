#include "identify/modal_form.h"

#include <stdexcept>

#include <gtest/gtest.h>

#include "plants.h"

namespace sinerig::identify {
namespace {

using namespace test;

double largest_error(const ZerosPolesGain& plant, const std::vector<double>& grid) {
  const StateSpace system = to_modal_form(plant);
  double largest = 0.0;
  for (const double omega : grid)
    largest = std::max(largest, std::abs(system.at(omega) / plant.at(omega) - 1.0));
  return largest;
}

TEST(ModalForm, HasTheResponseOfTheModel) {
  std::mt19937_64 random(1);
  EXPECT_LT(largest_error(gimbal_b(), gimbal_grid()), 1e-10);
  EXPECT_LT(largest_error(wide_plant(13, random), wide_grid()), 1e-8);
  for (int run = 0; run < 50; ++run)
    EXPECT_LT(largest_error(RandomGimbal<std::mt19937_64>(random).plant, gimbal_grid()), 1e-8);
}

TEST(ModalForm, TakesEqualOrdersPolesAtTheOriginAndZerosThere) {
  EXPECT_LT(largest_error({{-3.0, -40.0}, {-10.0, -200.0}, 2.0, 1e-3}, log_grid(1, 100, 20)),
            1e-12);
  EXPECT_LT(largest_error({{-3.0}, {0.0, 0.0, 0.0, -10.0}, 2.0, 0.0}, log_grid(1, 100, 20)), 1e-12);
  EXPECT_LT(largest_error({{0.0}, {0.0, 0.0, -10.0}, 2.0, 0.0}, log_grid(1, 100, 20)), 1e-12);
  EXPECT_EQ(to_modal_form({{}, {}, 7.0, 0.0}).D, 7.0);
}

TEST(ModalForm, IsBlockDiagonalWithEvenlySharedGains) {
  const StateSpace system = to_modal_form(gimbal_b());
  ASSERT_EQ(system.A.rows(), 7);
  for (Eigen::Index i = 0; i < 7; ++i)
    for (Eigen::Index k = 0; k < 7; ++k) {
      if (std::abs(i - k) > 1) {
        EXPECT_EQ(system.A(i, k), 0.0);
      }
    }
  const double omega = 2.0 * std::numbers::pi * 23.0;
  EXPECT_NEAR(system.A(2, 2), -0.01 * omega, 1e-9 * omega);
  EXPECT_NEAR(system.B.segment(2, 2).norm(), system.C.segment(2, 2).norm(), 1e-12);
}

TEST(ModalForm, FallsBackToAChainWherePolesAreDouble) {
  EXPECT_LT(largest_error({{}, {-10.0, -10.0, -30.0}, 2.0, 0.0}, log_grid(1, 100, 20)), 1e-12);
  EXPECT_THROW(to_modal_form({{-1.0, -2.0}, {-10.0}, 2.0, 0.0}), std::invalid_argument);
}

}  // namespace
}  // namespace sinerig::identify
