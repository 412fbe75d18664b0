#include "record/confidence.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "support/stored_runs.h"

namespace sinerig::record {
namespace {

constexpr double t_ten = 2.22814;  // 97.5 % quantile of Student's t, ten degrees of freedom
constexpr double t_many = 1.95996;

StoredPoint without_intervals() {
  StoredPoint point = test::lag_point(0, 10.0, 1.0, 2);
  point.dof = 10.0;
  point.gain_interval_db = std::nan("");
  point.phase_interval_deg = std::nan("");
  return point;
}

TEST(Confidence, TakesTheStoredIntervals) {
  StoredPoint point = test::lag_point(0, 10.0, 1.0, 2);
  point.gain_interval_db = 0.08685889638;
  point.phase_interval_deg = 0.5729577951;
  EXPECT_NEAR(half_width95(point).gain, 0.01, 1e-9);
  EXPECT_NEAR(half_width95(point).phase_rad, 0.01, 1e-9);
}

TEST(Confidence, SplitsTheCovarianceAlongAndAcrossTheResponse) {
  StoredPoint point = without_intervals();
  point.response = {0.0, 2.0};
  point.covariance = {.re_re = 4e-4, .re_im = 0.0, .im_im = 1e-4};
  EXPECT_NEAR(half_width95(point).gain, t_ten * 0.01 / 2.0, 1e-5);
  EXPECT_NEAR(half_width95(point).phase_rad, t_ten * 0.02 / 2.0, 1e-5);
}

TEST(Confidence, TurnsWithTheResponse) {
  // Scatter along the diagonal, response along the diagonal: all of it is gain.
  StoredPoint point = without_intervals();
  point.dof = std::numeric_limits<double>::infinity();
  point.response = {1.0, 1.0};
  point.covariance = {.re_re = 1e-4, .re_im = 1e-4, .im_im = 1e-4};
  EXPECT_NEAR(half_width95(point).gain, t_many * 0.01, 1e-6);
  EXPECT_NEAR(half_width95(point).phase_rad, 0.0, 1e-9);
}

TEST(Confidence, IsUnknownWithoutDegreesOfFreedomAndNeverAboveHalfATurn) {
  StoredPoint point = without_intervals();
  point.covariance.re_re = 1e6;
  point.covariance.im_im = 1e6;
  EXPECT_EQ(half_width95(point).phase_rad, std::numbers::pi);
  point.dof = 0.0;
  EXPECT_TRUE(std::isnan(half_width95(point).gain));
  EXPECT_TRUE(std::isnan(circular_variance(point)));
}

TEST(Confidence, ACircularScatterComesBackAsItsVariance) {
  StoredPoint point = without_intervals();
  point.covariance = {.re_re = 3e-6, .re_im = 0.0, .im_im = 3e-6};
  EXPECT_NEAR(circular_variance(point), 3e-6, 1e-15);
}

// y = H u + v with v of variance s² in each component of its coefficient over one cycle: the part
// of the power that goes with u is |HU|²/(|HU|² + 2 s²), and n cycles leave H with s²/(n |U|²).
TEST(Coherence, IsThePartOfTheOutputsPowerThatGoesWithTheInput) {
  constexpr double rate_hz = 1000.0;
  constexpr double cycles = 80.0;
  constexpr double input = 0.5;
  constexpr double noise = 0.3;
  StoredPoint point = test::lag_point(0, 10.0, 1.0, 2);
  point.samples = cycles * rate_hz / point.frequency_hz;
  const double variance = noise * noise / (cycles * input * input);
  point.covariance = {.re_re = 0.5 * variance, .re_im = 0.0, .im_im = 1.5 * variance};
  const double signal = input * input * std::norm(point.response);
  EXPECT_NEAR(coherence(point, rate_hz), signal / (signal + 2.0 * noise * noise), 1e-12);
  // Twice as long with half the variance is the same rig.
  point.samples *= 2.0;
  point.covariance = point.covariance.scaled(0.5);
  EXPECT_NEAR(coherence(point, rate_hz), signal / (signal + 2.0 * noise * noise), 1e-12);
}

TEST(Coherence, IsOneWithoutNoiseAndUnknownWithoutScatterOrRate) {
  StoredPoint point = test::lag_point(0, 10.0, 1.0, 2);
  point.covariance = {.re_re = 0.0, .re_im = 0.0, .im_im = 0.0};
  EXPECT_EQ(coherence(point, 1000.0), 1.0);
  EXPECT_TRUE(std::isnan(coherence(point, 0.0)));
  point.dof = 0.0;
  EXPECT_TRUE(std::isnan(coherence(point, 1000.0)));
}

}  // namespace
}  // namespace sinerig::record
