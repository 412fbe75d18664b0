#include "report/sparkline.h"

#include <limits>

#include <gtest/gtest.h>

namespace sinerig::report {
namespace {

TEST(Sparkline, DrawsADiagonalDotByDot) {
  // Two characters wide, one high: 4 × 4 dots, the diagonal from the lower left.
  const auto rows = sparkline({{0.0, 0.0}, {3.0, 3.0}}, 2, 1, 0.0, 3.0, 0.0, 3.0);
  ASSERT_EQ(rows.size(), 1U);
  // Dots (0,3) (1,2) in the first character, (0,1) (1,0) in the second.
  EXPECT_EQ(rows[0], "\u2860\u280a");
}

TEST(Sparkline, LeavesGapsWhereThereIsNoNumber) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto rows = sparkline({{0.0, 0.0}, {1.0, nan}, {3.0, 0.0}}, 2, 1, 0.0, 3.0, 0.0, 3.0);
  EXPECT_EQ(rows[0], "\u2840\u2880");
}

TEST(Sparkline, KeepsToItsRange) {
  const auto rows = sparkline({{-1.0, 0.0}, {0.0, 9.0}}, 2, 2, 0.0, 3.0, 0.0, 3.0);
  EXPECT_EQ(rows[0] + rows[1], "    ");
  EXPECT_TRUE(sparkline({}, 0, 3, 0.0, 1.0, 0.0, 1.0).empty());
}

}  // namespace
}  // namespace sinerig::report
