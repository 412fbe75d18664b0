// From blocks to a point: the ratio of two measured Fourier coefficients and its covariance.
#pragma once

#include <array>
#include <complex>
#include <cstdint>

#include "sweep/nonblocking.h"

namespace sinerig {

// Covariance of (Re H, Im H).
struct Covariance2 {
  double re_re = 0.0;
  double re_im = 0.0;
  double im_im = 0.0;
};

// H = mean(Y) / mean(U) over the blocks of a dwell, both as measured, so that a clamped or
// quantised command does no harm. Streaming (Welford), no allocation.
class ResponseEstimator {
 public:
  void reset() noexcept { *this = {}; }

  // Y and U of one block, as b + j a.
  void add(std::complex<double> output, std::complex<double> input) noexcept SINERIG_NONBLOCKING;

  std::uint32_t blocks() const noexcept { return blocks_; }
  std::complex<double> input() const noexcept { return {mean_[2], mean_[3]}; }
  std::complex<double> output() const noexcept { return {mean_[0], mean_[1]}; }

  // NaN before the first block or without any input.
  std::complex<double> response() const noexcept;

  // Of the mean over the blocks, from their scatter about Y = H U (first order in the errors of Y
  // and U together). NaN below two blocks.
  Covariance2 covariance() const noexcept;

 private:
  std::uint32_t blocks_ = 0;
  std::array<double, 4> mean_{};                    // Re Y, Im Y, Re U, Im U
  std::array<std::array<double, 4>, 4> scatter_{};  // sums of products of deviations
};

}  // namespace sinerig
