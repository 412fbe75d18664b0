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
      plain_solver_{1 + 2 * max_bins},
      plain_gram_(triangle(1 + 2 * max_bins)),
      whole_{1 + 2 * max_bins},
      late_{1 + 2 * max_bins},
      part_input_(max_bins),
      column_(2 + 2 * max_bins),
      moved_output_(2 + 2 * max_bins),
      moved_input_(2 + 2 * max_bins),
      scratch_(2 + 2 * max_bins) {}

double WindowEstimator::Solution::variance(std::size_t order) const noexcept {
  const double dof = std::max(1.0, sums.count - static_cast<double>(order));
  return residual_square / dof;
}

bool WindowEstimator::solve(const Regression& regression, const Window& window, std::size_t channel,
                            Solution& solution) noexcept {
  const std::size_t order = regression.order();
  regression.window(channel, window.first, window.last, solution.sums);
  if (solution.sums.count <= static_cast<double>(order)) return false;
  if (!solution.solver.factor(solution.sums.gram, order)) return false;
  std::copy_n(solution.sums.moments.begin(), order, solution.beta.begin());
  solution.solver.solve(std::span{solution.beta}.first(order));
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
    if (estimate.input == std::complex<double>{}) return false;
  }
  const double noise = output_.variance(order);
  double distortion = 0.0;
  for (std::size_t bin = estimates.size(); bin < estimates.size() + harmonics; ++bin) {
    // Three times its expectation is what noise alone exceeds in one bin of twenty.
    const double floor = 3.0 * 4.0 * noise / output_.sums.count;
    distortion += std::max(0.0, std::norm(phasor_of(output_.beta, bin)) - floor);
  }
  estimates[0].distortion = std::sqrt(distortion) / std::abs(estimates[0].output);
  take_clusters(regression, window, pair, estimates);
  return true;
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
      solution.solver.solve(std::span{column_}.first(order));
      block[k][0] = column_[rows[0]] * variance;
      block[k][1] = column_[rows[1]] * variance;
    }
    return Covariance2{block[0][0], block[0][1], block[1][1]};
  };
  estimate.white = multiplied(covariance(output_), output_.turn[tone] / estimate.input);
  if (!pair.exact_input) {
    const auto by_input = -estimate.response * input_.turn[tone] / estimate.input;
    estimate.white = sum(estimate.white, multiplied(covariance(input_), by_input));
  }
  estimate.residual_rms = std::sqrt(output_.variance(order));
  estimate.drift_per_sample = output_.beta[Regression::drift_row];
}

// How the cluster in cluster_ moves the coefficients: G⁻¹ (S_q − G_q β).
void WindowEstimator::influence(const Solution& solution, std::size_t order,
                                std::vector<double>& moved) noexcept {
  const std::span score{moved.data(), order};
  multiply(cluster_.gram, {solution.beta.data(), order}, score);
  for (std::size_t i = 0; i < order; ++i) score[i] = cluster_.moments[i] - score[i];
  solution.solver.solve(score);
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
    regression.window(pair.output, begin, end, cluster_);
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
      regression.window(pair.input, begin, end, cluster_);
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
    const double to_white = output_.variance(order) / std::norm(estimate.input);
    estimate.scatter *= estimate.white.mean_variance() / (estimate.scatter_white * to_white);
    estimate.scatter_dof = 2.0 * (clusters - 1.0);
    estimate.burst = others > 0.0 ? worst / others : 1.0;
  }
}

// All regressors but the drift and the harmonics.
std::size_t WindowEstimator::plain_row(std::size_t i) const noexcept {
  if (i == 0) return Regression::constant_row;
  const std::size_t skipped = i > 2 * tones_ ? 2 * harmonics_ : 0;
  return Regression::cosine_row(0) + i - 1 + skipped;
}

// The sums in cluster_ without drift and harmonics, into plain.
bool WindowEstimator::fit_plain(std::size_t order, Plain& plain) noexcept {
  const std::size_t rows = order - 1 - 2 * harmonics_;
  if (cluster_.count <= static_cast<double>(rows)) return false;
  for (std::size_t i = 0; i < rows; ++i) {
    for (std::size_t k = 0; k <= i; ++k) {
      plain_gram_[triangle(i) + k] = cluster_.gram[triangle(plain_row(i)) + plain_row(k)];
    }
    plain.beta[i] = cluster_.moments[plain_row(i)];
  }
  if (!plain_solver_.factor(plain_gram_, rows)) return false;
  plain_solver_.solve(std::span{plain.beta}.first(rows));
  double explained = 0.0;
  for (std::size_t i = 0; i < rows; ++i)
    explained += plain.beta[i] * cluster_.moments[plain_row(i)];
  plain.variance =
      std::max(0.0, cluster_.square - explained) / (cluster_.count - static_cast<double>(rows));
  for (std::size_t row = 1; row <= 2 * tones_; ++row) {
    std::fill(column_.begin(), column_.end(), 0.0);
    column_[row] = 1.0;
    plain_solver_.solve(std::span{column_}.first(rows));
    plain.spread[row] = column_[row];
  }
  return true;
}

bool WindowEstimator::stray(const Regression& regression, const Window& window,
                            std::size_t late_first, const Pair& pair, double most_noise,
                            std::span<const Estimate> estimates, std::span<Stray> strays) noexcept {
  const std::size_t order = regression.order();
  const std::size_t tones = estimates.size();
  const auto difference = [&](std::size_t channel) {
    regression.window(channel, window.first, window.last, cluster_);
    if (!fit_plain(order, whole_)) return false;
    regression.window(channel, late_first, window.last, cluster_);
    return fit_plain(order, late_);
  };
  const auto moved = [&](std::size_t tone) {
    const std::size_t a = 1 + 2 * tone;
    return std::complex<double>{late_.beta[a + 1] - whole_.beta[a + 1],
                                late_.beta[a] - whole_.beta[a]};
  };
  std::fill_n(part_input_.begin(), tones, std::complex<double>{});
  if (!pair.exact_input) {
    if (!difference(pair.input)) return false;
    for (std::size_t tone = 0; tone < tones; ++tone) {
      part_input_[tone] = moved(tone) * input_.turn[tone];
    }
  }
  if (!difference(pair.output)) return false;
  const double variance = std::min(late_.variance, most_noise * most_noise);
  for (std::size_t tone = 0; tone < tones; ++tone) {
    const Estimate& estimate = estimates[tone];
    const auto shift = moved(tone) * output_.turn[tone] - estimate.response * part_input_[tone];
    const std::size_t a = 1 + 2 * tone;
    const double spread =
        late_.spread[a] + late_.spread[a + 1] - whole_.spread[a] - whole_.spread[a + 1];
    strays[tone] = {
        .shift = std::abs(shift / estimate.output),
        .noise = std::sqrt(variance * std::max(0.0, spread)) / std::abs(estimate.output)};
  }
  return true;
}

}  // namespace sinerig
