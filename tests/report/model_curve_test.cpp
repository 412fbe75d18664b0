#include "report/model_curve.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "support/stored_runs.h"

namespace sinerig::report {
namespace {

double largest_gain(const record::StoredFit& fit, double from_hz, double to_hz) {
  double largest = 0.0;
  for (const auto& value : model_response(fit, curve_grid(fit, from_hz, to_hz)))
    largest = std::max(largest, std::abs(value));
  return largest;
}

TEST(ModelCurve, FollowsTheModel) {
  const auto response = model_response(test::lag_fit(), {1.0, 10.0});
  EXPECT_NEAR(std::abs(response[0] - test::lag_at(1.0, 2.0)), 0.0, 1e-12);
  EXPECT_NEAR(std::abs(response[1] - test::lag_at(10.0, 2.0)), 0.0, 1e-12);
}

TEST(ModelCurve, CutsNoPeakOff) {
  const double omega = 2.0 * std::numbers::pi * 23.456;
  constexpr double damping = 1e-4;
  record::StoredFit fit;
  fit.num = {omega * omega};
  fit.den = {1.0, 2.0 * damping * omega, omega * omega};
  EXPECT_NEAR(largest_gain(fit, 0.1, 1000.0), 0.5 / damping, 0.01 * 0.5 / damping);
}

TEST(ModelCurve, StandsBehindTheHoldAndThePath) {
  // Far below the rate a hold delays by half its period.
  record::StoredFit fit = test::lag_fit();
  fit.hold_period_s = 1e-3;
  fit.path_delay_s = 2e-3;
  const auto held = model_response(fit, {1.0}).front() / test::lag_at(1.0, 2.0);
  EXPECT_NEAR(std::arg(held), -2.0 * std::numbers::pi * 2.5e-3, 1e-4);
  EXPECT_NEAR(std::abs(held), 1.0, 1e-4);
}

TEST(ModelCurve, IsTheLatestFit) {
  record::StoredRun run = test::two_channel_run(3);
  EXPECT_EQ(latest_fit(run, run.responses[0]), nullptr);
  run.fits = {test::lag_fit(), test::lag_fit()};
  EXPECT_EQ(latest_fit(run, run.responses[0]), &run.fits[1]);
  EXPECT_EQ(latest_fit(run, run.responses[1]), nullptr);
}

}  // namespace
}  // namespace sinerig::report
