#include "identify/transfer_function.h"

#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>

namespace sinerig::identify {
namespace {

using Complex = std::complex<double>;

TEST(TransferFunction, EvaluatesAFirstOrderLagWithDelay) {
  const TransferFunction lag{.num = {2.0}, .den = {0.5, 1.0}, .delay_s = 0.1};
  const auto response = lag.at(2.0);  // 2/(1+j) · exp(−0.2 j)
  EXPECT_NEAR(std::abs(response), std::sqrt(2.0), 1e-15);
  EXPECT_NEAR(std::arg(response), -std::atan(1.0) - 0.2, 1e-15);
}

TEST(TransferFunction, FindsRootsIncludingThoseAtTheOrigin) {
  const TransferFunction model{.num = {0.0, 2.0, -6.0}, .den = {1.0, 2.0, 5.0, 0.0}, .delay_s = 0};
  const auto zeros = model.zeros();
  const auto poles = model.poles();
  ASSERT_EQ(zeros.size(), 1U);
  EXPECT_NEAR(zeros[0].real(), 3.0, 1e-14);
  ASSERT_EQ(poles.size(), 3U);
  EXPECT_EQ(poles[0], Complex(0.0));
  EXPECT_LT(std::abs(poles[1] - Complex(-1.0, 2.0)), 1e-14);
  EXPECT_EQ(poles[2], std::conj(poles[1]));
}

TEST(TransferFunction, KeepsItsResponseThroughZerosPolesGain) {
  const TransferFunction model{.num = {3.0, 1.0}, .den = {2.0, 5.0, 7.0, 0.0}, .delay_s = 0.02};
  const ZerosPolesGain zpk = to_zeros_poles_gain(model);
  const TransferFunction back = to_transfer_function(zpk);
  EXPECT_DOUBLE_EQ(zpk.gain, 1.5);
  EXPECT_DOUBLE_EQ(back.den[0], 1.0);
  for (const double omega : {0.01, 1.0, 40.0}) {
    EXPECT_LT(std::abs(zpk.at(omega) / model.at(omega) - 1.0), 1e-14);
    EXPECT_LT(std::abs(back.at(omega) / model.at(omega) - 1.0), 1e-14);
  }
}

TEST(TransferFunction, ScalesRootsOfAnyMagnitude) {
  const auto roots = roots_of({1e-24, 3e-12, 2.0});
  EXPECT_NEAR(roots[0].real() / -1e12, 1.0, 1e-13);
  EXPECT_NEAR(roots[1].real() / -2e12, 1.0, 1e-13);
}

TEST(TransferFunction, RefusesAPolynomialWithoutRoots) {
  EXPECT_THROW(roots_of({}), std::invalid_argument);
  EXPECT_THROW(roots_of({0.0, 0.0}), std::invalid_argument);
}

}  // namespace
}  // namespace sinerig::identify
