// From a window of the regression to a point: the ratio of two Fourier coefficients, its covariance
// from two sides (the residual, the scatter of the window's clusters), and what else the window
// tells of its quality.
#pragma once

#include <complex>
#include <cstdint>
#include <span>
#include <vector>

#include "sweep/nonblocking.h"
#include "sweep/normal_equations.h"
#include "sweep/regression.h"

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

// How far a part of a window strays from the fit of the whole, relative to H.
struct Stray {
  double shift = 0.0;  // of H
  double noise = 0.0;  // rms of that shift if there is nothing but white noise
};

class WindowEstimator {
 public:
  explicit WindowEstimator(std::size_t max_bins);

  // One estimate per tone; bins beyond are harmonics of the first. `omega_rad_s` per bin. False
  // where the window does not determine the coefficients.
  bool estimate(const Regression& regression, const Window& window, const Pair& pair,
                std::span<const double> omega_rad_s, std::size_t harmonics,
                std::span<Estimate> estimates) noexcept SINERIG_NONBLOCKING;

  // Of the estimate that failed: the input holds nothing at all.
  bool input_silent() const noexcept { return input_silent_; }

  // Whether a channel is its tones alone over the window, on a constant or a bias motion, within a
  // millionth.
  bool is_sinusoidal(const Regression& regression, const Window& window, std::size_t channel,
                     std::size_t tones, std::size_t harmonics) noexcept SINERIG_NONBLOCKING;

  // Of the window last estimated: how far its late part, from checkpoint `late_first` on, strays
  // from the whole, both fitted without the drift and the harmonics, which in a single cycle would
  // swallow a ringing transient. The noise is that of the late part, but
  // `most_noise` at most. False where the tones are not determined.
  bool stray(const Regression& regression, const Window& window, std::size_t late_first,
             const Pair& pair, double most_noise, std::span<const Estimate> estimates,
             std::span<Stray> strays) noexcept SINERIG_NONBLOCKING;

 private:
  bool input_silent_ = false;

  // The solution of one channel over the window.
  struct Solution {
    NormalSums sums;
    NormalSolver solver;
    std::vector<double> beta;
    double residual_square = 0.0;
    double slope = 0.0;                 // drift per block
    std::vector<double> through_drift;  // what an error of the staircase makes of each coefficient
    std::vector<std::complex<double>> turn;  // per tone: from the tick to the samples' true time

    explicit Solution(std::size_t max_order)
        : sums{max_order},
          solver{max_order},
          beta(max_order),
          through_drift(max_order),
          turn(max_order) {}
    double variance(std::size_t order) const noexcept;
  };

  // … and without drift and harmonics.
  struct Plain {
    std::vector<double> beta;
    std::vector<double> spread;  // variance of each coefficient for a noise of one
    double variance = 0.0;       // of the residual

    explicit Plain(std::size_t rows) : beta(rows), spread(rows) {}
  };

  bool solve(const Regression& regression, const Window& window, std::size_t channel,
             Solution& solution) noexcept;
  void load(const Regression& regression, const Window& window, std::size_t first, std::size_t last,
            std::size_t channel, double slope, NormalSums& sums) noexcept;
  void take_slope(Solution& solution, std::size_t order) noexcept;
  void take_coefficients(const Pair& pair, std::size_t order, std::size_t tone,
                         Estimate& estimate) noexcept;
  void take_distortion(const Pair& pair, std::size_t order, Estimate& estimate) noexcept;
  void take_clusters(const Regression& regression, const Window& window, const Pair& pair,
                     std::span<Estimate> estimates) noexcept;
  double white_influence(std::size_t order, std::size_t tone) noexcept;
  double cluster_residual(std::size_t order) noexcept;
  bool fit_plain(std::size_t order, Plain& plain) noexcept;
  std::size_t plain_row(std::size_t i) const noexcept;
  void influence(const Solution& solution, std::size_t order, std::vector<double>& moved) noexcept;

  Solution input_;
  Solution output_;
  std::size_t tones_ = 0;
  std::size_t harmonics_ = 0;  // bins that follow the tones
  NormalSums cluster_;
  Staircase stairs_;
  std::vector<double> drift_products_;  // of the drift with the instruments
  NormalSolver plain_solver_;
  std::vector<double> plain_gram_;
  Plain whole_;
  Plain late_;
  std::vector<std::complex<double>> part_input_;  // per tone
  std::vector<double> part_input_noise_;          // variance of that
  std::vector<double> column_;
  std::vector<double> moved_output_;
  std::vector<double> moved_input_;
  std::vector<double> scratch_;
};

}  // namespace sinerig
