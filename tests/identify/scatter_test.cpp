#include "identify/scatter.h"

#include <gtest/gtest.h>

namespace sinerig::identify {
namespace {

TEST(Scatter, PoolsNeighboursByTheirDegreesOfFreedom) {
  const Response response{
      {1.0, 1.0, 2.0, 0.5, 4.0}, {2.0, 1.0, 9.0, 0.0, 9.0}, {3.0, 1.0, 0, 0, 0}};
  const Response pooled = pooled_scatter(response, {2.0, 1.0, 0.0});
  for (const ResponsePoint& point : pooled) {
    EXPECT_DOUBLE_EQ(point.variance_re, (2.0 * 3.0 + 9.0) / 3.0);
    EXPECT_DOUBLE_EQ(point.variance_im, point.variance_re);
    EXPECT_EQ(point.covariance, 0.0);
  }
}

// Without noise most points do not scatter at all: a fit wants a figure for every point.
TEST(Scatter, TakesTheNearestThatHasAny) {
  Response response;
  for (int i = 0; i < 20; ++i) response.push_back({1.0 + i, 1.0, 0.0, 0.0, 0.0});
  response[2].variance_re = response[2].variance_im = 4.0;
  response[17].variance_re = response[17].variance_im = 9.0;
  const Response pooled = pooled_scatter(response, std::vector<double>(20, 6.0));
  EXPECT_DOUBLE_EQ(pooled[8].variance_re, 4.0);
  EXPECT_DOUBLE_EQ(pooled[8].variance_im, 4.0);
  EXPECT_DOUBLE_EQ(pooled[12].variance_re, 9.0);
  check_response(pooled, 1);
}

TEST(Scatter, StaysUnknownWhereNoPointHasAny) {
  const Response pooled = pooled_scatter({{1.0, 1.0, 0, 0, 0}, {2.0, 1.0, 0, 0, 0}}, {0.0, 0.0});
  EXPECT_FALSE(has_scatter(pooled));
}

TEST(Scatter, MergesRepeatedFrequenciesByTheirInformation) {
  const Response a{{1.0, 1.0, 1.0, 0.0, 1.0}, {3.0, 5.0, 1.0, 0.0, 1.0}};
  const Response b{{1.0, 4.0, 0.5, 0.0, 0.5}, {2.0, 7.0, 1.0, 0.0, 1.0}};
  const Response both = merged({a, b});
  ASSERT_EQ(both.size(), 3U);
  EXPECT_DOUBLE_EQ(both[0].response.real(), 3.0);
  EXPECT_DOUBLE_EQ(both[0].variance_re, 1.0 / 3.0);
  EXPECT_EQ(both[1].omega_rad_s, 2.0);
  EXPECT_EQ(both[2].response.real(), 5.0);
}

TEST(Scatter, AveragesPlainlyWithoutScatter) {
  const Response one{{1.0, 1.0, 0, 0, 0}};
  const Response both = merged({one, one, {{1.0, 4.0, 0, 0, 0}}});
  ASSERT_EQ(both.size(), 1U);
  EXPECT_DOUBLE_EQ(both[0].response.real(), 2.0);
}

}  // namespace
}  // namespace sinerig::identify
