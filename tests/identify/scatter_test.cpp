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
