#include "identify/response.h"

#include <limits>
#include <stdexcept>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sinerig::identify {
namespace {

using testing::HasSubstr;

std::string refusal(const Response& response, std::size_t minimum_points = 1) {
  try {
    check_response(response, minimum_points);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

Response two_points() {
  return {point_with_relative_scatter(1.0, {1.0, 2.0}, 0.01),
          point_with_relative_scatter(2.0, {1.0, 1.0}, 0.01)};
}

TEST(Response, AcceptsOrderedPointsWithScatter) {
  EXPECT_EQ(refusal(two_points()), "");
  EXPECT_TRUE(has_scatter(two_points()));
}

TEST(Response, RefusesWhatCannotBeFittedAndSaysWhere) {
  Response response = two_points();
  response[1].omega_rad_s = 1.0;
  EXPECT_THAT(refusal(response),
              HasSubstr("point 2 (0.1591549431 Hz): the frequency occurs twice"));
  response[1].omega_rad_s = 0.5;
  EXPECT_THAT(refusal(response), HasSubstr("must ascend; sort"));
  response = two_points();
  response[1].response = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(refusal(response), HasSubstr("point 2"));
  EXPECT_THAT(refusal(response), HasSubstr("not finite"));
  response[0].response = response[1].response = 0.0;
  EXPECT_THAT(refusal(response), HasSubstr("every point is zero"));
  EXPECT_THAT(refusal(two_points(), 5),
              HasSubstr("2 points, but the model asked for needs at least 5"));
}

TEST(Response, RefusesAPartialOrImpossibleCovariance) {
  Response response = two_points();
  response[1].variance_re = response[1].variance_im = 0.0;
  EXPECT_THAT(refusal(response), HasSubstr("every point or for none"));
  response = two_points();
  response[0].covariance = 2.0 * response[0].variance_re;
  EXPECT_THAT(refusal(response), HasSubstr("positive semidefinite"));
}

}  // namespace
}  // namespace sinerig::identify
