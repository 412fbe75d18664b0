#include "identify/least_squares_fit.h"

#include <functional>
#include <stdexcept>

#include <gtest/gtest.h>

#include "identify/choe.h"
#include "identify/maximum_likelihood.h"
#include "plants.h"

namespace sinerig::identify {
namespace {

using namespace test;

constexpr HassulOrders third_order{3, 0, 0};

TEST(LeastSquaresFit, KeepsTheCoefficientsAndIsMonic) {
  const Response response = exact_response(choe_example_3(), choe_grid());
  const auto weights = inverse_frequency_weights(response);
  const TransferFunction model = fit_hassul(response, third_order, weights);
  const Fit fit = describe_least_squares(response, {}, third_order, model, weights);
  EXPECT_EQ(fit.model.den[0], 1.0);
  EXPECT_NEAR(fit.model.num[0] / 309673.0, 1.0, 1e-9);
  EXPECT_NEAR(fit.model.den[3] / 317356.0, 1.0, 1e-9);
  EXPECT_TRUE(fit.converged);
  EXPECT_LT(fit.chi2, 1e-15);
}

// First-order errors predict the scatter over noise; at 0.1 % the bias is far below it.
TEST(LeastSquaresFit, StandardErrorsPredictTheScatter) {
  struct Case {
    const char* name;
    std::function<std::vector<double>(const Response&)> weights;
  };
  const Case cases[] = {{"none", unit_weights},
                        {"1/w", inverse_frequency_weights},
                        {"Choe", [](const Response& r) {
                           return fit_choe(r, third_order).weight;
                         }}};
  for (const Case& each : cases) {
    std::mt19937_64 random(5);
    const TransferFunction plant = choe_example_3();
    int inside = 0;
    constexpr int runs = 300;
    for (int run = 0; run < runs; ++run) {
      const Response response = noisy_response(plant, choe_grid(), 1e-4, random);
      const auto weights = each.weights(response);
      const TransferFunction model = fit_hassul(response, third_order, weights);
      const Fit fit = describe_least_squares(response, {}, third_order, model, weights);
      inside += std::abs(fit.model.den[2] - plant.den[2]) <= 1.959964 * fit.den_standard_error[2];
    }
    EXPECT_GT(100.0 * inside / runs, 91.0) << each.name;
    EXPECT_LT(100.0 * inside / runs, 98.5) << each.name;
  }
}

TEST(LeastSquaresFit, WithTheWeightsOfMaximumLikelihoodHasItsErrors) {
  std::mt19937_64 random(2);
  const Response response = noisy_response(choe_example_3(), choe_grid(), 1e-3, random);
  const auto weights = weights_from(choe_example_3(), response);  // 1/|B| but for a factor
  const TransferFunction model = fit_hassul(response, third_order, weights);
  const Fit linear = describe_least_squares(response, {}, third_order, model, weights);
  FitOptions options;
  options.poles = 3;
  const Fit best = fit_maximum_likelihood(response, options);
  for (std::size_t i = 1; i < 4; ++i)
    EXPECT_NEAR(linear.den_standard_error[i] / best.den_standard_error[i], 1.0, 0.02);
}

TEST(LeastSquaresFit, DividesOutAKnownDelayAndCountsPolesAtTheOrigin) {
  ZerosPolesGain plant = gimbal_b();
  const Response response = exact_response(plant, gimbal_grid());
  plant.delay_s = 0.0;
  const Response without_delay = exact_response(plant, gimbal_grid());
  const HassulOrders orders{6, 4, 1};
  const auto weights = inverse_frequency_weights(response);
  FitOptions options;
  options.delay = Delay::known;
  options.delay_s = 1.5e-3;
  const Fit fit = describe_least_squares(response, options, orders,
                                         fit_hassul(without_delay, orders, weights), weights);
  EXPECT_EQ(fit.model.delay_s, 1.5e-3);
  EXPECT_EQ(fit.zpk.poles.front(), 0.0);
  EXPECT_LT(gain_error(fit.zpk, gimbal_b(), gimbal_grid()).max_db, 1e-6);
  EXPECT_THROW(describe_least_squares(response, options, orders,
                                      fit_hassul(without_delay, orders, weights), {1.0}),
               std::invalid_argument);
}

}  // namespace
}  // namespace sinerig::identify
