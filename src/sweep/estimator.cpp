#include "sweep/estimator.h"

#include <algorithm>
#include <cmath>

namespace sinerig {

namespace {

std::complex<double> phasor_of(const std::vector<double>& beta, std::size_t bin) noexcept {
  return {beta[Regression::sine_row(bin)], beta[Regression::cosine_row(bin)]};
}

// Referred from the tick to the true time of the samples.
std::complex<double> turn(double omega_rad_s, std::int64_t offset_ns) noexcept {
  return std::polar(1.0, -omega_rad_s * static_cast<double>(offset_ns) * 1e-9);
}

// Covariance of q z, z = (re, im) with covariance c, q a complex number.
Covariance2 multiplied(const Covariance2& c, std::complex<double> q) noexcept {
  const double r = q.real();
  const double i = q.imag();
  return {.re_re = r * r * c.re_re - 2.0 * r * i * c.re_im + i * i * c.im_im,
          .re_im = r * i * (c.re_re - c.im_im) + (r * r - i * i) * c.re_im,
          .im_im = i * i * c.re_re + 2.0 * r * i * c.re_im + r * r * c.im_im};
}

Covariance2 sum(const Covariance2& a, const Covariance2& b) noexcept {
  return {a.re_re + b.re_re, a.re_im + b.re_im, a.im_im + b.im_im};
}

}  // namespace

WindowEstimator::WindowEstimator(std::size_t max_bins)
    : input_{2 + 2 * max_bins},
      output_{2 + 2 * max_bins},
      cluster_{2 + 2 * max_bins},
      stairs_{2 + 2 * max_bins},
      drift_products_(2 + 2 * max_bins),
      stray_{max_bins},
      column_(2 + 2 * max_bins),
      moved_output_(2 + 2 * max_bins),
      moved_input_(2 + 2 * max_bins),
      scratch_(2 + 2 * max_bins) {}

double WindowEstimator::Solution::variance(std::size_t order) const noexcept {
  const double dof = std::max(1.0, sums.count - static_cast<double>(order));
  return residual_square / dof;
}

// The sums of a stretch of the window, `slope` times the drift taken out of the channel. With a
// staircase the drift's row holds that one's products.
void WindowEstimator::load(const Regression& regression, const Window& window, std::size_t first,
                           std::size_t last, std::size_t channel, double slope,
                           NormalSums& sums) noexcept {
  regression.window(channel, first, last, sums);
  if (window.block == 0) return;
  regression.staircase(channel, first, last, window.first, window.block, stairs_);
  constexpr std::size_t drift = Regression::drift_row;
  const std::size_t order = regression.order();
  const auto element = [&](std::size_t row) -> double& {
    return row < drift ? sums.gram[triangle(drift) + row] : sums.gram[triangle(row) + drift];
  };
  sums.square += slope * (slope * element(drift) - 2.0 * sums.moments[drift]);
  for (std::size_t row = 0; row < order; ++row) {
    const bool is_drift = row == drift;
    drift_products_[row] = is_drift ? stairs_.products[drift] : element(row);
    const double moment = is_drift ? stairs_.moment : sums.moments[row];
    sums.moments[row] = moment - slope * drift_products_[row];
    element(row) = is_drift ? stairs_.square : stairs_.products[row];
  }
}

// The slope of the drift, with the staircase as its instrument: the solution of Zᵀ(y − Xβ) = 0, Z
// the regressors with the staircase in the place of the drift. Regressing on Z gives b = Tβ, T the
// unit matrix but for the drift's column, which is the drift regressed on Z.
void WindowEstimator::take_slope(Solution& solution, std::size_t order) noexcept {
  constexpr std::size_t drift = Regression::drift_row;
  const std::span through{solution.through_drift.data(), order};
  std::copy_n(drift_products_.begin(), order, through.begin());
  solution.solver.solve(through);
  const double climb = through[drift];
  solution.slope = climb > 0.0 ? solution.beta[drift] / climb : 0.0;
  for (double& each : through) each = climb > 0.0 ? each / climb : 0.0;
}

bool WindowEstimator::solve(const Regression& regression, const Window& window, std::size_t channel,
                            Solution& solution) noexcept {
  const std::size_t order = regression.order();
  load(regression, window, window.first, window.last, channel, 0.0, solution.sums);
  if (solution.sums.count <= static_cast<double>(order)) return false;
  // A sensor slower than the loop may see a harmonic as the tone, or as another harmonic.
  if (!solution.solver.factor(solution.sums.gram, order, Regression::cosine_row(tones_)))
    return false;
  std::copy_n(solution.sums.moments.begin(), order, solution.beta.begin());
  solution.solver.solve(std::span{solution.beta}.first(order));
  solution.slope = solution.beta[Regression::drift_row];
  std::fill_n(solution.through_drift.begin(), order, 0.0);
  if (window.block > 0) {
    take_slope(solution, order);
    load(regression, window, window.first, window.last, channel, solution.slope, solution.sums);
    std::copy_n(solution.sums.moments.begin(), order, solution.beta.begin());
    solution.solver.solve(std::span{solution.beta}.first(order));
  }
  double explained = 0.0;
  for (std::size_t i = 0; i < order; ++i) explained += solution.beta[i] * solution.sums.moments[i];
  solution.residual_square = std::max(0.0, solution.sums.square - explained);
  return true;
}

bool WindowEstimator::estimate(const Regression& regression, const Window& window, const Pair& pair,
                               std::span<const double> omega_rad_s, std::size_t harmonics,
                               std::span<Estimate> estimates) noexcept {
  const std::size_t order = regression.order();
  tones_ = estimates.size();
  harmonics_ = harmonics;
  input_silent_ = false;
  if (!solve(regression, window, pair.input, input_)) return false;
  if (!solve(regression, window, pair.output, output_)) return false;
  const auto length =
      static_cast<double>(regression.samples_at(window.last) - regression.samples_at(window.first));
  for (std::size_t tone = 0; tone < estimates.size(); ++tone) {
    input_.turn[tone] = turn(omega_rad_s[tone], regression.common_offset_ns(pair.input));
    output_.turn[tone] = turn(omega_rad_s[tone], regression.common_offset_ns(pair.output));
    Estimate& estimate = estimates[tone];
    estimate = {};
    estimate.samples = output_.sums.count;
    estimate.lost = length - output_.sums.count;
    take_coefficients(pair, order, tone, estimate);
    input_silent_ = estimate.input == std::complex<double>{};
    if (input_silent_) return false;
  }
  take_distortion(pair, order, estimates[0]);
  take_clusters(regression, window, pair, estimates);
  return true;
}

std::optional<ChannelContent> WindowEstimator::content(const Regression& regression,
                                                       const Window& window, std::size_t channel,
                                                       std::size_t tones,
                                                       std::size_t harmonics) noexcept {
  tones_ = tones;
  if (!solve(regression, window, channel, input_)) return std::nullopt;
  ChannelContent content{.first_tone = phasor_of(input_.beta, 0)};
  for (std::size_t bin = 0; bin < tones; ++bin) {
    content.tone_power += 0.5 * std::norm(phasor_of(input_.beta, bin));
  }
  content.foreign_power = input_.residual_square / input_.sums.count;
  for (std::size_t bin = tones; bin < tones + harmonics; ++bin) {
    content.foreign_power += 0.5 * std::norm(phasor_of(input_.beta, bin));
  }
  return content;
}

bool WindowEstimator::is_sinusoidal(const Regression& regression, const Window& window,
                                    std::size_t channel, std::size_t tones,
                                    std::size_t harmonics) noexcept {
  constexpr double negligible = 1e-12;  // as a part of the power
  const auto found = content(regression, window, channel, tones, harmonics);
  return !found || found->foreign_power <= negligible * input_.sums.square / input_.sums.count;
}

void WindowEstimator::take_distortion(const Pair& pair, std::size_t order,
                                      Estimate& estimate) noexcept {
  // A harmonic that is in the command itself may come out of a linear plant this much stronger than
  // the tone does; what is louder is the plant's own doing, as are all under feedback.
  constexpr double most_favoured = 100.0;
  // Three times its expectation is what noise alone exceeds in one bin of twenty.
  const double floor = 3.0 * 4.0 * output_.variance(order) / output_.sums.count;
  double all = 0.0;
  double own = 0.0;
  for (std::size_t bin = tones_; bin < tones_ + harmonics_; ++bin) {
    const double power = std::max(0.0, std::norm(phasor_of(output_.beta, bin)) - floor);
    const double brought =
        most_favoured * std::abs(estimate.response) * std::abs(phasor_of(input_.beta, bin));
    all += power;
    if (!pair.exact_input || power > brought * brought) own += power;
  }
  estimate.distortion = std::sqrt(all) / std::abs(estimate.output);
  estimate.own_distortion = std::sqrt(own) / std::abs(estimate.output);
}

void WindowEstimator::take_coefficients(const Pair& pair, std::size_t order, std::size_t tone,
                                        Estimate& estimate) noexcept {
  estimate.input = phasor_of(input_.beta, tone) * input_.turn[tone];
  estimate.output = phasor_of(output_.beta, tone) * output_.turn[tone];
  if (estimate.input == std::complex<double>{}) return;
  estimate.response = estimate.output / estimate.input;

  // σ² times the tone's block of the inverse Gram matrix, for z = b + j a.
  const auto covariance = [&](const Solution& solution) {
    const double variance = solution.variance(order);
    const std::size_t rows[2] = {Regression::sine_row(tone), Regression::cosine_row(tone)};
    double block[2][2];
    for (int k = 0; k < 2; ++k) {
      std::fill(column_.begin(), column_.end(), 0.0);
      column_[rows[k]] = 1.0;
      column_[Regression::drift_row] = -solution.through_drift[rows[k]];
      solution.solver.solve(std::span{column_}.first(order));
      for (int l = 0; l < 2; ++l) {
        block[k][l] = variance * (column_[rows[l]] -
                                  solution.through_drift[rows[l]] * column_[Regression::drift_row]);
      }
    }
    return Covariance2{block[0][0], block[0][1], block[1][1]};
  };
  estimate.white = multiplied(covariance(output_), output_.turn[tone] / estimate.input);
  estimate.output_white = estimate.white.mean_variance();
  if (!pair.exact_input) {
    const auto by_input = -estimate.response * input_.turn[tone] / estimate.input;
    estimate.white = sum(estimate.white, multiplied(covariance(input_), by_input));
  }
  estimate.rms = std::sqrt(output_.sums.square / output_.sums.count);
  estimate.residual_rms = std::sqrt(output_.variance(order));
  estimate.drift_per_block = output_.slope;
}

// How the cluster in cluster_ moves the coefficients: G⁻¹ (S_q − G_q β).
void WindowEstimator::influence(const Solution& solution, std::size_t order,
                                std::vector<double>& moved) noexcept {
  const std::span score{moved.data(), order};
  multiply(cluster_.gram, {solution.beta.data(), order}, score);
  for (std::size_t i = 0; i < order; ++i) score[i] = cluster_.moments[i] - score[i];
  solution.solver.solve(score);
  const double climbed = score[Regression::drift_row];
  for (std::size_t i = 0; i < order; ++i) score[i] -= solution.through_drift[i] * climbed;
}

// Mean square of what a white residual of one makes of the tone's influence of the cluster in
// cluster_, the part that the fit takes out of it included (the correction of cluster-robust
// variances, Bell and McCaffrey 2002): gᵀ(G_q − G_q G⁻¹ G_q)g for the tone's rows g of G⁻¹.
double WindowEstimator::white_influence(std::size_t order, std::size_t tone) noexcept {
  double sum = 0.0;
  for (const std::size_t row : {Regression::sine_row(tone), Regression::cosine_row(tone)}) {
    const std::span g{column_.data(), order};
    std::fill(g.begin(), g.end(), 0.0);
    g[row] = 1.0;
    g[Regression::drift_row] = -output_.through_drift[row];
    output_.solver.solve(g);
    const std::span weighted{moved_output_.data(), order};
    const std::span back{scratch_.data(), order};
    multiply(cluster_.gram, g, weighted);
    std::copy(weighted.begin(), weighted.end(), back.begin());
    output_.solver.solve(back);
    for (std::size_t i = 0; i < order; ++i) sum += weighted[i] * (g[i] - back[i]);
  }
  return 0.5 * sum;
}

// Mean square of the output's residual in the cluster in cluster_.
double WindowEstimator::cluster_residual(std::size_t order) noexcept {
  multiply(cluster_.gram, {output_.beta.data(), order}, {column_.data(), order});
  double residual = cluster_.square;
  for (std::size_t i = 0; i < order; ++i) {
    residual += output_.beta[i] * (column_[i] - 2.0 * cluster_.moments[i]);
  }
  return residual / std::max(1.0, cluster_.count);
}

void WindowEstimator::take_clusters(const Regression& regression, const Window& window,
                                    const Pair& pair, std::span<Estimate> estimates) noexcept {
  const std::size_t order = regression.order();
  double clusters = 0.0;
  double worst = 0.0;
  double power = 0.0;
  double heard = 0.0;
  double early = 0.0;
  // A transient is loudest in the first quarter, a burst is louder than that.
  const std::size_t burst_first =
      window.settled ? window.first : window.first + (window.last - window.first + 3) / 4;
  for (Estimate& estimate : estimates) estimate.scatter_white = 0.0;
  for (std::size_t end = window.last; end >= window.first + window.cluster; end -= window.cluster) {
    const std::size_t begin = end - window.cluster;
    load(regression, window, begin, end, pair.output, output_.slope, cluster_);
    for (std::size_t tone = 0; tone < estimates.size(); ++tone) {
      estimates[tone].scatter_white += white_influence(order, tone);
    }
    influence(output_, order, moved_output_);
    const double residual = cluster_residual(order);
    if (begin >= burst_first) {
      worst = std::max(worst, residual);
      power += residual;
      heard += 1.0;
    } else {
      early = std::max(early, residual);
    }
    if (!pair.exact_input) {
      load(regression, window, begin, end, pair.input, input_.slope, cluster_);
      influence(input_, order, moved_input_);
    }
    for (std::size_t tone = 0; tone < estimates.size(); ++tone) {
      Estimate& estimate = estimates[tone];
      auto moved = phasor_of(moved_output_, tone) * output_.turn[tone];
      if (!pair.exact_input) {
        moved -= estimate.response * phasor_of(moved_input_, tone) * input_.turn[tone];
      }
      estimate.scatter += 0.5 * std::norm(moved / estimate.input);
    }
    clusters += 1.0;
  }
  const double others = std::max(early, (power - worst) / std::max(1.0, heard - 1.0));
  for (Estimate& estimate : estimates) {
    if (clusters < 2.0 || !(estimate.scatter_white > 0.0)) {
      estimate.scatter = 0.0;
      continue;
    }
    // What is expected of white noise in the output alone: what the input's adds has scattered,
    // too.
    const double to_white = output_.variance(order) / std::norm(estimate.input);
    estimate.scatter *= estimate.output_white / (estimate.scatter_white * to_white);
    estimate.scatter_dof = 2.0 * (clusters - 1.0);
    estimate.burst = others > 0.0 ? worst / others : 1.0;
  }
}

bool WindowEstimator::stray(const Regression& regression, const Window& window,
                            std::size_t late_first, const Pair& pair, double most_noise,
                            std::span<const Estimate> estimates, std::span<Stray> strays) noexcept {
  return stray_.estimate(
      regression, {.first = window.first, .late_first = late_first, .last = window.last}, pair,
      most_noise, harmonics_, {.input = input_.turn, .output = output_.turn}, estimates, strays);
}

}  // namespace sinerig
