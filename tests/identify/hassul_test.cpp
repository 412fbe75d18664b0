#include "identify/hassul.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "plants.h"

namespace sinerig::identify {
namespace {

using namespace test;

// A plant of any n/m and k with damped poles and zeros spread over the band.
ZerosPolesGain spread_plant(int n, int m, int k) {
  ZerosPolesGain plant;
  const auto place = [](std::vector<std::complex<double>>& roots, int count, double shift) {
    for (int i = 0; i + 1 < count; i += 2)
      add_pair(roots, shift * std::pow(10.0, (i + 0.5) / 7.0 - 0.5), 0.3);
    if (count % 2 == 1) add_real(roots, shift * 2.0);
  };
  place(plant.poles, n, 1.0);
  place(plant.zeros, m, 1.4);
  set_static_gain(plant, 3.0);
  for (int i = 0; i < std::abs(k); ++i) (k > 0 ? plant.poles : plant.zeros).push_back(0.0);
  return plant;
}

class HassulExactData : public testing::TestWithParam<int> {};

TEST_P(HassulExactData, RecoversEveryCoefficient) {
  const int k = GetParam();
  const auto grid = log_grid(1.0, 40.0, 60);
  for (const auto& [n, m] :
       {std::pair{1, 0}, {2, 0}, {2, 1}, {3, 0}, {3, 1}, {3, 2}, {4, 3}, {5, 4}, {6, 5}, {7, 6}}) {
    const TransferFunction truth = to_transfer_function(spread_plant(n, m, k));
    const Response response = exact_response(truth, grid);
    const TransferFunction model =
        fit_hassul(response, {n, m, k}, inverse_frequency_weights(response));
    ASSERT_EQ(model.num.size(), truth.num.size());
    ASSERT_EQ(model.den.size(), truth.den.size());
    const double common = model.den[0];
    for (std::size_t i = 0; i < truth.den.size(); ++i)
      EXPECT_NEAR(model.den[i] / common, truth.den[i], 1e-9 * std::abs(truth.den[i]))
          << n << '/' << m << " k " << k << " den " << i;
    for (std::size_t i = 0; i < truth.num.size(); ++i)
      EXPECT_NEAR(model.num[i] / common, truth.num[i], 1e-9 * std::abs(truth.num[i]))
          << n << '/' << m << " k " << k << " num " << i;
  }
}

INSTANTIATE_TEST_SUITE_P(AllOriginOrders, HassulExactData, testing::Values(-1, 0, 1, 2));

TEST(Hassul, NormalEquationsAgreeWithQrWhereTheConditioningAllows) {
  std::mt19937_64 random(7);
  const Response response = noisy_response(choe_example_3(), choe_grid(), 0.01, random);
  for (const auto& weights : {unit_weights(response), inverse_frequency_weights(response)}) {
    const TransferFunction by_qr = fit_hassul(response, {3, 0, 0}, weights);
    const TransferFunction by_normal = fit_hassul_normal_equations(response, {3, 0, 0}, weights);
    for (std::size_t i = 0; i < by_qr.den.size(); ++i)
      EXPECT_NEAR(by_normal.den[i] / by_qr.den[i], 1.0, 1e-7);
  }
}

TEST(Hassul, BuildsTheSixBlocksOfThePaper) {
  const Response response{{2.0, {0.5, -0.25}, 0, 0, 0}, {3.0, {0.1, -0.2}, 0, 0, 0}};
  const HassulSystem system = hassul_system(response, {2, 1, 0}, unit_weights(response));
  const std::complex<double> inverse = 1.0 / std::complex<double>(0.5, -0.25);
  ASSERT_EQ(system.Omega.rows(), 4);
  ASSERT_EQ(system.Omega.cols(), 4);
  Eigen::RowVector4d real_row{1.0, -4.0, 0.0, 2.0 * inverse.imag()};
  Eigen::RowVector4d imaginary_row{0.0, 0.0, 2.0, -2.0 * inverse.real()};
  EXPECT_LT((system.Omega.row(0) - real_row).norm(), 1e-15);
  EXPECT_LT((system.Omega.row(2) - imaginary_row).norm(), 1e-15);
  EXPECT_DOUBLE_EQ(system.V[0], inverse.real());
  EXPECT_DOUBLE_EQ(system.V[2], inverse.imag());
}

TEST(Hassul, AnAllPoleModelHasNoSpuriousZero) {
  const Response response = exact_response(choe_example_3(), choe_grid());
  EXPECT_EQ(hassul_system(response, {3, 0, 0}, unit_weights(response)).Omega.cols(), 4);
}

TEST(Hassul, RefusesWhatItCannotSolve) {
  const Response response = exact_response(choe_example_3(), {1.0, 2.0});
  try {
    fit_hassul(response, {3, 2, 0}, unit_weights(response));
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("2 points"));
  }
  EXPECT_THROW(fit_hassul(response, {1, 0, 0}, {1.0}), std::invalid_argument);
  EXPECT_THROW(fit_hassul(response, {1, 0, 0}, {1.0, -1.0}), std::invalid_argument);
  EXPECT_THROW(fit_hassul(response, {-1, 0, 0}, unit_weights(response)), std::invalid_argument);
}

}  // namespace
}  // namespace sinerig::identify
