#include "identify/transfer_function.h"

#include <cmath>

#include <gtest/gtest.h>

namespace sinerig::identify {
namespace {

TEST(TransferFunction, EvaluatesAFirstOrderLagWithDelay) {
  const TransferFunction lag{.num = {2.0}, .den = {0.5, 1.0}, .delay_s = 0.1};
  const auto response = lag.at(2.0);  // 2/(1+j) · exp(−0.2 j)
  EXPECT_NEAR(std::abs(response), std::sqrt(2.0), 1e-15);
  EXPECT_NEAR(std::arg(response), -std::atan(1.0) - 0.2, 1e-15);
}

}  // namespace
}  // namespace sinerig::identify
