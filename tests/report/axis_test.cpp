#include "report/axis.h"

#include <cmath>

#include <gtest/gtest.h>

namespace sinerig::report {
namespace {

TEST(Axis, StepsAreOneTwoFive) {
  EXPECT_DOUBLE_EQ(nice_step(10.0, 5.0), 2.0);
  EXPECT_DOUBLE_EQ(nice_step(100.0, 4.0), 50.0);
  EXPECT_DOUBLE_EQ(nice_step(0.07, 10.0), 0.01);
}

TEST(Axis, AnglesAreDividedLikeACircle) {
  EXPECT_EQ(angle_step(400.0, 5.0), 90.0);
  EXPECT_EQ(angle_step(900.0, 4.0), 360.0);
  EXPECT_DOUBLE_EQ(angle_step(8.0, 5.0), 2.0);
}

TEST(Axis, LabelsDecadesWithTwoAndFiveWhereThereIsRoom) {
  EXPECT_EQ(log_ticks(0.5, 200.0, 20.0).major,
            (std::vector<double>{0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0}));
  EXPECT_EQ(log_ticks(0.5, 200.0, 4.0).major, (std::vector<double>{1.0, 10.0, 100.0}));
}

TEST(Axis, StepsEquallyInsideADecade) {
  EXPECT_EQ(log_ticks(20.0, 50.0, 3.0).major, (std::vector<double>{20.0, 30.0, 40.0, 50.0}));
}

// A step that rounding swallows must not go on for ever.
TEST(Axis, EndsWhereTheStepIsBelowTheRounding) {
  const double low = 1.0;
  const double high = 1.0 + 4e-16;
  EXPECT_LE(linear_ticks(low, high, 1e-17).major.size(), 2U);
  EXPECT_LE(linear_ticks(0.0, 1.0, 1e-12).major.size(), 1000U);
  EXPECT_TRUE(linear_ticks(0.0, 1.0, std::nan("")).major.empty());
}

TEST(Axis, MapsEndsToEnds) {
  const Axis axis{.low = 1.0, .high = 100.0, .from = 10.0, .to = 210.0, .logarithmic = true};
  EXPECT_DOUBLE_EQ(axis(1.0), 10.0);
  EXPECT_DOUBLE_EQ(axis(10.0), 110.0);
  EXPECT_DOUBLE_EQ(axis(100.0), 210.0);
}

TEST(Axis, LabelsHaveAMinusAndPowers) {
  EXPECT_EQ(tick_label(-20.0, 10.0), "−20");
  EXPECT_EQ(tick_label(0.25, 0.05), "0.25");
  EXPECT_EQ(tick_label(1e-6, 0.0), "10⁻⁶");
  EXPECT_EQ(tick_label(2e-7, 0.0), "2·10⁻⁷");
  EXPECT_EQ(tick_label(0.5, 0.0), "0.5");
}

}  // namespace
}  // namespace sinerig::report
