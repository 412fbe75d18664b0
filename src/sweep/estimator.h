// From a window of the regression to a point: the ratio of two Fourier coefficients, its covariance
// from two sides (the residual, the scatter of the window's clusters), and what else the window
// tells of its quality.
#pragma once

#include <complex>
#include <optional>
#include <span>
#include <vector>

#include "sweep/estimate.h"
#include "sweep/nonblocking.h"
#include "sweep/normal_equations.h"
#include "sweep/regression.h"
#include "sweep/stray.h"

namespace sinerig {

// What one channel holds over a window, beside a constant, a drift and a bias motion.
struct ChannelContent {
  std::complex<double> first_tone;  // b + j a, at the tick
  double tone_power = 0.0;          // all tones
  double foreign_power = 0.0;       // their harmonics and the rest
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

  // Lost samples are left out; nothing where too few are there. `harmonics` bins follow the tones.
  std::optional<ChannelContent> content(const Regression& regression, const Window& window,
                                        std::size_t channel, std::size_t tones,
                                        std::size_t harmonics) noexcept SINERIG_NONBLOCKING;

  // Whether a channel is its tones alone over the window, on a constant or a bias motion, within a
  // millionth.
  bool is_sinusoidal(const Regression& regression, const Window& window, std::size_t channel,
                     std::size_t tones, std::size_t harmonics) noexcept SINERIG_NONBLOCKING;

  // How far the late part of the window last estimated, from checkpoint `late_first` on, strays
  // from the whole: see StrayEstimator.
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
  void influence(const Solution& solution, std::size_t order, std::vector<double>& moved) noexcept;

  Solution input_;
  Solution output_;
  std::size_t tones_ = 0;
  std::size_t harmonics_ = 0;  // bins that follow the tones
  NormalSums cluster_;
  Staircase stairs_;
  std::vector<double> drift_products_;  // of the drift with the instruments
  StrayEstimator stray_;
  std::vector<double> column_;
  std::vector<double> moved_output_;
  std::vector<double> moved_input_;
  std::vector<double> scratch_;
};

}  // namespace sinerig
