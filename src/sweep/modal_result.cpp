// What the window of a modelled dwell says: the response, its variance, the noise.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "sweep/modal_settling.h"

namespace sinerig {

namespace {

// A residual of this part of the target, relative to the signal, is harmless.
constexpr double harmless_part_of_target = 0.003;

constexpr double most_noise_dof = 20000.0;

// Standard errors by which the scatter of a window and of those before has to exceed that of white
// noise to be taken for coloured.
constexpr double coloured_sigmas = 2.0;

// … of which so many count for a window: noise is not stationary for ever.
constexpr double most_pooled_dof = 200.0;

// Covariance of q z with that of z.
Covariance2 multiplied(const Covariance2& c, std::complex<double> q) noexcept {
  const double r = q.real();
  const double i = q.imag();
  return {.re_re = r * r * c.re_re - 2.0 * r * i * c.re_im + i * i * c.im_im,
          .re_im = r * i * (c.re_re - c.im_im) + (r * r - i * i) * c.re_im,
          .im_im = i * i * c.re_re + 2.0 * r * i * c.re_im + r * r * c.im_im};
}

// The tone at another phase.
Phasor shifted(Phasor tone, double angle_rad) noexcept {
  if (angle_rad == 0.0) return tone;
  const double c = std::cos(angle_rad);
  const double s = std::sin(angle_rad);
  return {.cosine = tone.cosine * c - tone.sine * s, .sine = tone.sine * c + tone.cosine * s};
}

std::complex<double> turn(double omega_rad_s, std::int64_t offset_ns) noexcept {
  return std::polar(1.0, -omega_rad_s * static_cast<double>(offset_ns) * 1e-9);
}

}  // namespace

// What the residual of the window may be: the noise, or a part of the target so small that no
// transient of its size matters. Nothing real is linear to 120 dB.
double ModalSettling::expected_noise(std::size_t output) const noexcept {
  const double mean = window_.moments[2] / window_.count;
  const double power = std::max(0.0, window_.square / window_.count - mean * mean);
  const double target = task_.relative_target();
  const double harmless = harmless_part_of_target * target;
  return std::max(noise_[output].variance, harmless * harmless * power);
}

// s² of the window, pooled with what the noise has been: a short window hardly knows.
double ModalSettling::noise_of_window(std::size_t output,
                                      const ModalSolution& solution) const noexcept {
  const double dof = std::max(1.0, solution.samples - solution.unknowns);
  const double known = std::min(noise_[output].dof, most_pooled_dof);
  return (dof * solution.residual_variance() + known * expected_noise(output)) / (dof + known);
}

// The applied tone over the window, without a transient. What was applied a little late or early
// turns the tone; that it is a sine is judged from tick to tick.
bool ModalSettling::fit_input(const ModalStore& store) noexcept {
  std::array<double, tone_columns> beta{};
  const auto fit = [&](bool at_true_times) {
    NormalSums& sums = input_sums_;
    std::fill(sums.gram.begin(), sums.gram.end(), 0.0);
    std::fill(sums.moments.begin(), sums.moments.end(), 0.0);
    sums.square = 0.0;
    ModalSample sample;
    for (std::uint64_t at = blocks_.edge[0]; at < blocks_.edge[block_count_]; ++at) {
      if (!store.sample(0, at, sample)) continue;
      const Phasor tone =
          at_true_times ? shifted(sample.tone, task_.omega_rad_s * sample.off_grid_s) : sample.tone;
      const double x[tone_columns] = {tone.cosine, tone.sine, 1.0};
      for (std::size_t i = 0; i < tone_columns; ++i) {
        for (std::size_t j = 0; j <= i; ++j) sums.gram[triangle(i) + j] += x[i] * x[j];
        sums.moments[i] += x[i] * sample.value;
      }
      sums.square += sample.value * sample.value;
    }
    if (!inverse_.factor(sums.gram, tone_columns)) return false;
    std::copy_n(sums.moments.begin(), tone_columns, beta.begin());
    inverse_.solve(beta);
    return true;
  };
  if (!fit(false)) return false;
  double left = input_sums_.square;
  for (std::size_t i = 0; i < tone_columns; ++i) left -= beta[i] * input_sums_.moments[i];
  input_residual_ = left / std::max(input_sums_.square, 1e-300);
  if (!fit(true)) return false;
  input_ =
      std::complex<double>{beta[1], beta[0]} * turn(task_.omega_rad_s, store.common_offset_ns(0));
  return std::abs(input_) > 0.0;
}

// From solution_, window_ and the blocks.
bool ModalSettling::fill_result(const ModalStore& store, std::size_t output) noexcept {
  const std::complex<double> turned =
      turn(task_.omega_rad_s, store.common_offset_ns(outputs_[output]));
  const double variance = noise_of_window(output, solution_);
  ModalResult& result = results_[output];
  result = {};
  Estimate& estimate = result.estimate;
  estimate.input = input_;
  estimate.output = solution_.tone * turned;
  estimate.response = estimate.output / input_;
  estimate.white = multiplied(solution_.covariance, turned / input_).scaled(variance);
  estimate.samples = solution_.samples;
  estimate.lost =
      static_cast<double>(blocks_.edge[block_count_] - blocks_.edge[0]) - solution_.samples;
  estimate.residual_rms = std::sqrt(variance);
  estimate.rms = std::sqrt(window_.square / window_.count);
  // The scatter of the blocks' influence on the tone, against what a white residual would make.
  const std::size_t columns = regression_.columns();
  solver_.tone_gain({by_sine_.data(), columns}, {by_cosine_.data(), columns});
  const std::uint64_t half_cycle = task_.cycle_samples / 2;
  const std::uint64_t length = blocks_.edge[block_count_] - blocks_.edge[0];
  const std::uint64_t cluster = std::min<std::uint64_t>(half_cycle, length / 6);
  double scatter = 0.0;
  double white = 0.0;
  double clusters = 0.0;
  for (std::size_t i = 0; i < block_count_;) {
    cluster_.clear(columns);
    const std::uint64_t begin = blocks_.edge[i];
    while (i < block_count_) {
      cluster_.add(blocks_.sums[i], columns);
      ++i;
      if (blocks_.edge[i] - begin >= cluster) break;
    }
    for (const auto* gain : {&by_sine_, &by_cosine_}) {
      multiply(cluster_.gram, {solution_.coefficients.data(), columns}, {product_.data(), columns});
      double moved = 0.0;
      for (std::size_t k = 0; k < columns; ++k) {
        moved += (*gain)[k] * (cluster_.moments[k] - product_[k]);
      }
      multiply(cluster_.gram, {gain->data(), columns}, {product_.data(), columns});
      double expected = 0.0;
      for (std::size_t k = 0; k < columns; ++k) expected += (*gain)[k] * product_[k];
      expected -= solver_.explained({product_.data(), columns});
      scatter += 0.5 * moved * moved;
      white += 0.5 * std::max(0.0, expected);
    }
    clusters += 1.0;
  }
  if (clusters >= 3.0 && white > 0.0 && solution_.residual_variance() > 0.0) {
    estimate.scatter =
        scatter / (white * solution_.residual_variance()) * estimate.white.mean_variance();
    estimate.scatter_dof = 2.0 * (clusters - 1.0);
    estimate.scatter_white = white;
  }
  result.variance =
      memories_[output].pooled(estimate, task_.omega_rad_s / (2.0 * std::numbers::pi), true);
  if (result.variance.dof == 0.0) {
    result.variance = {.covariance = estimate.white,
                       .dof = std::min(noise_[output].dof, most_pooled_dof)};
  }
  // The white variance is known much better; it stands where nothing speaks against it.
  const double colour = result.variance.covariance.mean_variance() / estimate.white.mean_variance();
  if (colour < 1.0 + coloured_sigmas * std::sqrt(2.0 / result.variance.dof)) {
    result.variance.covariance = estimate.white;
    result.variance.dof =
        std::max(result.variance.dof, std::min(noise_[output].dof, most_pooled_dof));
    result.variance.expected = 1.0;
  }
  result.known = true;
  return true;
}

// The half widths over the targets, the larger: the dwell is long enough at 1.
double ModalSettling::target_excess() const noexcept {
  const ModalResult& result = results_[0];
  if (result.variance.dof == 0.0) return std::numeric_limits<double>::infinity();
  const Interval half = interval_of(result.estimate.response, result.variance, 0.0,
                                    std::max(1.0, result.variance.expected));
  const double gain = task_.target_db > 0.0 ? half.gain_db / task_.target_db : 0.0;
  const double phase = task_.target_deg > 0.0 ? half.phase_deg / task_.target_deg : 0.0;
  return std::max(gain, phase);
}

void ModalSettling::learn_noise(std::size_t output) noexcept {
  OutputNoise& noise = noise_[output];
  const double dof = solution_.samples - solution_.unknowns;
  const double variance = solution_.residual_variance();
  noise.variance = (noise.variance * noise.dof + variance * dof) / (noise.dof + dof);
  noise.dof = std::min(noise.dof + dof, most_noise_dof);
  memories_[output].learn(results_[output].estimate, task_.omega_rad_s / (2.0 * std::numbers::pi));
}

}  // namespace sinerig
