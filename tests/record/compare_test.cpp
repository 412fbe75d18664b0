#include "record/compare.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "support/stored_runs.h"

namespace sinerig::record {
namespace {

constexpr std::size_t points = 50;
constexpr double dof = 14.0;

// The lag measured with a relative scatter of `sigma` for each of re and im, its variance itself
// known only from a χ² of `dof` degrees.
StoredResponse measured(std::mt19937_64& random, double sigma, double gain = 2.0) {
  StoredResponse response{.input = 1, .output = 2, .points = {}};
  std::normal_distribution<double> normal;
  std::chi_squared_distribution<double> chi2{dof};
  for (std::uint32_t i = 0; i < points; ++i) {
    StoredPoint point = test::lag_point(i, 1.0 + i, gain, 2);
    const double scatter = sigma * std::abs(point.response);
    point.response += std::complex<double>{scatter * normal(random), scatter * normal(random)};
    const double variance = scatter * scatter * chi2(random) / dof;
    point.covariance = {.re_re = variance, .re_im = 0.0, .im_im = variance};
    point.dof = dof;
    point.gain_interval_db = point.phase_interval_deg = std::nan("");
    response.points.push_back(point);
  }
  return response;
}

TEST(Compare, CallsEqualResponsesDifferentAsOftenAsAllowed) {
  std::mt19937_64 random{1};
  const CompareSettings settings{.tolerance_db = 0.0, .tolerance_deg = 0.0, .false_alarm = 0.05};
  int alarms = 0;
  constexpr int runs = 2000;
  for (int i = 0; i < runs; ++i) {
    const StoredResponse a = measured(random, 0.01);
    alarms += compare_responses(a, measured(random, 0.01), settings).changed() ? 1 : 0;
  }
  // 5 % of 2000 is 100 with a standard deviation of 10.
  EXPECT_LT(alarms, 140);
  EXPECT_GT(alarms, 50);
}

TEST(Compare, SeesAChangeAboveTheScatter) {
  std::mt19937_64 random{2};
  const StoredResponse a = measured(random, 0.001);
  const Difference difference = compare_responses(a, measured(random, 0.001, 2.04), {});
  EXPECT_GT(difference.changed_points(), 40U);
  EXPECT_NEAR(difference.points[10].gain_db, 20.0 * std::log10(1.02), 0.05);
  // ±t95 · √2 · 0.1 % with some 28 degrees of freedom.
  EXPECT_NEAR(difference.points[10].gain95_db, 8.69 * 2.05 * 0.001414, 0.012);
}

TEST(Compare, AToleranceForgivesSmallChanges) {
  std::mt19937_64 random{3};
  const StoredResponse a = measured(random, 1e-6);
  const StoredResponse b = measured(random, 1e-6, 2.01);
  EXPECT_TRUE(compare_responses(a, b, {}).changed());
  const CompareSettings tolerant{.tolerance_db = 0.1, .tolerance_deg = 0.1};
  EXPECT_FALSE(compare_responses(a, b, tolerant).changed());
}

// A tolerance for the gain alone: the phase differs by no more than it scatters.
TEST(Compare, JudgesGainAndPhaseEachByItsOwnTolerance) {
  std::mt19937_64 random{5};
  const StoredResponse a = measured(random, 0.001);
  const StoredResponse louder = measured(random, 0.001, 2.1);
  EXPECT_TRUE(compare_responses(a, louder, {}).changed());
  EXPECT_FALSE(compare_responses(a, louder, {.tolerance_db = 1.0}).changed());
  EXPECT_TRUE(compare_responses(a, louder, {.tolerance_deg = 1.0}).changed());
  StoredResponse later = a;
  for (StoredPoint& point : later.points) point.response *= std::polar(1.0, 0.01);
  EXPECT_FALSE(compare_responses(a, later, {.tolerance_deg = 1.0}).changed());
  EXPECT_TRUE(compare_responses(a, later, {.tolerance_db = 1.0}).changed());
}

TEST(Compare, WithoutScatterOnlyTheTolerancesCount) {
  StoredResponse a = test::two_channel_run(10).responses[1];
  for (StoredPoint& point : a.points) point.dof = 0.0;
  StoredResponse b = a;
  EXPECT_FALSE(compare_responses(a, b, {}).changed());
  b.points[4].response *= 1.001;
  const Difference difference = compare_responses(a, b, {});
  EXPECT_EQ(difference.changed_points(), 1U);
  EXPECT_TRUE(difference.points[4].changed);
  EXPECT_TRUE(std::isnan(difference.points[4].probability));
}

TEST(Compare, TakesTheOneScatterThatIsKnown) {
  std::mt19937_64 random{4};
  const StoredResponse a = measured(random, 0.01);
  StoredResponse b = measured(random, 0.01);
  for (StoredPoint& point : b.points) point.dof = 0.0;
  const Difference difference = compare_responses(a, b, {});
  EXPECT_TRUE(difference.scatter_known());
  EXPECT_FALSE(difference.changed());
}

TEST(Compare, RoundingOfAFileIsNoChange) {
  StoredResponse a = test::two_channel_run(10).responses[1];
  for (StoredPoint& point : a.points) point.dof = 0.0;
  StoredResponse b = a;
  for (StoredPoint& point : b.points) point.response *= 1.0 + 1e-13;
  const Difference difference = compare_responses(a, b, {});
  EXPECT_FALSE(difference.changed());
  EXPECT_FALSE(difference.scatter_known());
}

TEST(Compare, PointsThatCannotBeMeasuredAnyMoreAreAChange) {
  const StoredResponse a = test::two_channel_run(20).responses[1];
  StoredResponse b = a;
  b.points[3].status = "low_signal";
  const Difference one = compare_responses(a, b, {});
  EXPECT_EQ(one.lost, 1U);
  EXPECT_FALSE(one.changed());
  for (std::size_t i = 0; i < 12; ++i) b.points[i].status = "low_signal";
  const Difference many = compare_responses(a, b, {});
  EXPECT_EQ(many.lost, 12U);
  EXPECT_EQ(many.changed_points(), 0U);
  EXPECT_TRUE(many.changed());
  // The other way round they were not there before.
  EXPECT_FALSE(compare_responses(b, a, {}).changed());
  for (StoredPoint& point : b.points) point.status = "low_signal";
  EXPECT_FALSE(compare_responses(a, b, {}).compared());
}

TEST(Compare, CountsWhatItCannotCompare) {
  const StoredResponse a = test::two_channel_run(20).responses[0];
  StoredResponse b = test::two_channel_run(20).responses[1];
  b.points.erase(b.points.begin() + 3);
  const Difference difference = compare_responses(a, b, {});
  EXPECT_EQ(difference.unmatched, 1U);
  EXPECT_EQ(difference.unusable, 6U);  // six points of the first are not good
  EXPECT_EQ(difference.points.size(), 13U);
}

}  // namespace
}  // namespace sinerig::record
