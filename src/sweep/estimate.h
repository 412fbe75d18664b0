// What a window of the regression tells of one tone.
#pragma once

#include <complex>
#include <cstddef>

namespace sinerig {

// Covariance of (Re H, Im H).
struct Covariance2 {
  double re_re = 0.0;
  double re_im = 0.0;
  double im_im = 0.0;

  double mean_variance() const noexcept { return 0.5 * (re_re + im_im); }
  Covariance2 scaled(double factor) const noexcept {
    return {re_re * factor, re_im * factor, im_im * factor};
  }
};

struct Pair {
  std::size_t input = 0;  // regression channels
  std::size_t output = 1;
  bool exact_input = true;  // the input is known, not measured: it carries no noise of its own
};

// A window of the regression, in checkpoints, and the clusters that it is cut into.
struct Window {
  std::size_t first = 0;
  std::size_t last = 0;
  std::size_t cluster = 1;  // checkpoints per cluster
  // Checkpoints per block where the drift is to be taken from the means of the blocks, which
  // unmodelled harmonics leave alone; 0: from all samples.
  std::size_t block = 0;
  bool settled = false;  // for certain: what is loud at its beginning is not a transient
};

struct Estimate {
  std::complex<double> response;
  std::complex<double> input;  // U and Y at their true times, b + j a
  std::complex<double> output;
  Covariance2 white;            // of H, were the residual white
  double output_white = 0.0;    // … mean variance of a component, by the output's residual alone
  double scatter = 0.0;         // variance of one component of H from the clusters
  double scatter_white = 0.0;   // what that scatter is to white noise of one in the output
  double scatter_dof = 0.0;     // 0: too few clusters
  double rms = 0.0;             // of the output, all tones
  double residual_rms = 0.0;    // of the output
  double distortion = 0.0;      // of the output: harmonics beyond the noise, relative to the tone
  double own_distortion = 0.0;  // … without those that harmonics of the input may explain
  double drift_per_block = 0.0;
  double burst = 0.0;    // residual power of the worst cluster over that of the others
  double lost = 0.0;     // samples of the output that are missing
  double samples = 0.0;  // of the output that were used
};

}  // namespace sinerig
