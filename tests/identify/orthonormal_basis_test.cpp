#include "identify/orthonormal_basis.h"

#include <cmath>

#include <gtest/gtest.h>

namespace sinerig::identify {
namespace {

using Complex = std::complex<double>;

Eigen::ArrayXd four_decades() {
  return Eigen::ArrayXd::LinSpaced(400, -2.0, 2.0).unaryExpr([](double e) {
    return std::pow(10.0, e);
  });
}

TEST(OrthonormalBasis, IsOrthonormalAtOrder26OverFourDecades) {
  const Eigen::ArrayXd x = four_decades();
  const Eigen::ArrayXd weight = x.pow(-13.0);
  const OrthonormalBasis basis(x, weight, 26);
  for (int k = 0; k <= 26; ++k)
    for (int l = k % 2; l <= k; l += 2) {
      const double product =
          (weight.square() * basis.factor().col(k).array() * basis.factor().col(l).array()).sum();
      EXPECT_NEAR(product, k == l ? 1.0 : 0.0, 1e-13);
    }
}

TEST(OrthonormalBasis, EvaluatesTheSamePolynomialOnAndOffTheGrid) {
  const Eigen::ArrayXd x = Eigen::ArrayXd::LinSpaced(30, 0.1, 3.0);
  const OrthonormalBasis basis(x, Eigen::ArrayXd::Ones(30), 5);
  const Eigen::VectorXd c = Eigen::VectorXd::LinSpaced(6, 1.0, -2.0);
  const Eigen::ArrayXcd values = basis.on_grid(c);
  const Eigen::VectorXd ascending = basis.power_coefficients().transpose() * c;
  for (Eigen::Index i = 0; i < 30; ++i) {
    const Complex s{0.0, x[i]};
    Complex powers = 0.0;
    for (Eigen::Index k = 5; k >= 0; --k) powers = powers * s + ascending[k];
    EXPECT_LT(std::abs(basis.at(c, s).value - values[i]), 1e-13);
    EXPECT_LT(std::abs(powers - values[i]), 1e-12);
  }
}

TEST(OrthonormalBasis, FindsRootsFarBelowAndAboveTheCentre) {
  const Eigen::ArrayXd x = four_decades();
  const OrthonormalBasis basis(x, x.pow(-1.5), 3);
  // (s + 0.01)(s² + 0.02·50 s + 50²), projected onto the basis by its values.
  const Complex pair{-0.5, std::sqrt(2500.0 - 0.25)};
  Eigen::VectorXd c = Eigen::VectorXd::Zero(4);
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const Complex s{0.0, x[i]};
    const Complex value = (s + 0.01) * (s - pair) * (s - std::conj(pair));
    for (int k = 0; k < 4; ++k)
      c[k] +=
          std::pow(x[i], -3.0) * basis.factor()(i, k) * (k % 2 == 0 ? value.real() : value.imag());
  }
  const auto roots = basis.roots(c);
  ASSERT_EQ(roots.size(), 3U);
  EXPECT_NEAR(roots[0].real() / -0.01, 1.0, 1e-11);
  EXPECT_LT(std::abs(roots[1] / pair - 1.0), 1e-12);
}

}  // namespace
}  // namespace sinerig::identify
