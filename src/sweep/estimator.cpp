#include "sweep/estimator.h"

#include <limits>

namespace sinerig {

namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

}  // namespace

void ResponseEstimator::add(std::complex<double> output, std::complex<double> input) noexcept {
  const std::array<double, 4> value{output.real(), output.imag(), input.real(), input.imag()};
  ++blocks_;
  std::array<double, 4> before{};
  std::array<double, 4> after{};
  for (std::size_t i = 0; i < 4; ++i) {
    before[i] = value[i] - mean_[i];
    mean_[i] += before[i] / blocks_;
    after[i] = value[i] - mean_[i];
  }
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < 4; ++j) scatter_[i][j] += before[i] * after[j];
  }
}

std::complex<double> ResponseEstimator::response() const noexcept {
  if (blocks_ == 0 || input() == std::complex<double>{}) return {nan, nan};
  return output() / input();
}

Covariance2 ResponseEstimator::covariance() const noexcept {
  if (blocks_ < 2 || input() == std::complex<double>{}) return {nan, nan, nan};
  // dH = (dY − H dU) / U, as a real 2×4 matrix on (Re dY, Im dY, Re dU, Im dU).
  const std::complex<double> by_output = 1.0 / input();
  const std::complex<double> by_input = -response() / input();
  const double jacobian[2][4] = {
      {by_output.real(), -by_output.imag(), by_input.real(), -by_input.imag()},
      {by_output.imag(), by_output.real(), by_input.imag(), by_input.real()}};
  const double scale = 1.0 / (static_cast<double>(blocks_) * (blocks_ - 1.0));
  const auto element = [&](std::size_t row, std::size_t column) {
    double sum = 0.0;
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j < 4; ++j) {
        sum += jacobian[row][i] * scatter_[i][j] * jacobian[column][j];
      }
    }
    return sum * scale;
  };
  return {.re_re = element(0, 0), .re_im = element(0, 1), .im_im = element(1, 1)};
}

}  // namespace sinerig
