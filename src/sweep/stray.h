// Whether a transient is still in a window: its late part, beside the whole, both fitted without
// the drift and the harmonics, which in a single cycle would swallow a ringing transient.
#pragma once

#include <complex>
#include <span>
#include <vector>

#include "sweep/estimate.h"
#include "sweep/nonblocking.h"
#include "sweep/normal_equations.h"
#include "sweep/regression.h"

namespace sinerig {

// How far a part of a window strays from the fit of the whole, relative to H.
struct Stray {
  double shift = 0.0;  // of H
  double noise = 0.0;  // rms of that shift if there is nothing but white noise
};

class StrayEstimator {
 public:
  explicit StrayEstimator(std::size_t max_bins);

  // The window in checkpoints, and where its late part begins.
  struct Parts {
    std::size_t first = 0;
    std::size_t late_first = 0;
    std::size_t last = 0;
  };

  // Per tone: from the tick to the true time of the samples.
  struct Turns {
    std::span<const std::complex<double>> input;
    std::span<const std::complex<double>> output;
  };

  // `estimates` are those of the whole window, of which the first tone has `harmonics` bins. The
  // noise is that of the late part, but `most_noise` at most. False where the tones are not
  // determined.
  bool estimate(const Regression& regression, const Parts& parts, const Pair& pair,
                double most_noise, std::size_t harmonics, const Turns& turns,
                std::span<const Estimate> estimates,
                std::span<Stray> strays) noexcept SINERIG_NONBLOCKING;

 private:
  // The fit of one stretch of one channel.
  struct Plain {
    std::vector<double> beta;
    std::vector<double> spread;  // variance of each coefficient for a noise of one
    double variance = 0.0;       // of the residual

    explicit Plain(std::size_t rows) : beta(rows), spread(rows) {}
  };

  bool fit(std::size_t order, Plain& plain) noexcept;
  std::size_t plain_row(std::size_t i) const noexcept;

  std::size_t tones_ = 0;
  std::size_t harmonics_ = 0;  // bins that follow the tones
  NormalSums sums_;
  NormalSolver solver_;
  std::vector<double> gram_;
  Plain whole_;
  Plain late_;
  std::vector<std::complex<double>> input_moved_;  // per tone
  std::vector<double> input_noise_;                // variance of that
  std::vector<double> column_;
};

}  // namespace sinerig
