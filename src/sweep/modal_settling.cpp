#include "sweep/modal_settling.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace sinerig {

namespace {

constexpr double db_per_relative = 20.0 / std::numbers::ln10;
constexpr double degrees_per_radian = 180.0 / std::numbers::pi;

constexpr std::uint64_t shortest_block = 8;
constexpr std::uint64_t blocks_per_window = 16;

// A pole this far from where the regression is linear, in radians over the time that its transient
// is seen, and with a second-order term of this many sigma, is linearised at again.
constexpr double far_rad = 0.06;
constexpr double seen_sigmas = 0.2;
constexpr int most_linearisations = 12;
constexpr int most_at_once = 8;
constexpr double least_damping_factor = 0.3;
constexpr double most_damping_factor = 3.0;

// More is left than the noise explains, in standard errors of a variance: at 4 none of 6000 dwells
// with the right modes was doubted.
constexpr double residual_sigmas = 4.0;

// A residual of this part of the target, relative to the signal, is harmless.
constexpr double harmless_part_of_target = 0.003;

// What was applied may hold this part of the target beside its tone, relative to it.
constexpr double harmonics_part_of_target = 0.1;

// A window that does not determine the tone is waited for until it is this much longer than asked.
constexpr std::uint64_t patient_windows = 2;
constexpr std::uint64_t patient_samples = 200;

// A window with fewer degrees of freedom cannot tell.
constexpr double least_dof = 8.0;

// The late half strays from the whole: allowed in sigma of what the noise makes of that, and as a
// part of the target.
constexpr double late_sigmas = 2.5;
constexpr double late_part_of_target = 0.25;

// … where the residual says that they are others: multiplies their variance.
constexpr double doubted_variance = 100.0;

// What a dwell knows of the poles is a little less sure in the next.
constexpr double forgetting = 1.05 * 1.05;

// No pole is believed to be known less than this, relative to its decay and frequency: further off
// the regression says nothing of it.
constexpr double least_known_real = 0.3;
constexpr double least_known_decay = 0.6;
constexpr double least_known_turn = 0.1;

constexpr double most_noise_dof = 20000.0;

// Standard errors by which the scatter of a window and of those before has to exceed that of white
// noise to be taken for coloured.
constexpr double coloured_sigmas = 2.0;

// … of which so many count for a window: noise is not stationary for ever.
constexpr double most_pooled_dof = 200.0;

double largest_eigenvalue(const Covariance2& c) noexcept {
  const double half = 0.5 * (c.re_re + c.im_im);
  const double apart = 0.5 * (c.re_re - c.im_im);
  return half + std::sqrt(apart * apart + c.re_im * c.re_im);
}

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

ModalSettling::ModalSettling(std::vector<std::size_t> outputs, double rate_hz)
    : outputs_{std::move(outputs)},
      rate_hz_{rate_hz},
      noise_(outputs_.size()),
      memories_(outputs_.size()),
      results_(outputs_.size()),
      inverse_{ModePrior::max_parameters},
      inverse_sums_{ModePrior::max_parameters},
      input_sums_{tone_columns} {}

void ModalSettling::know(const ModePrior& prior, std::span<const double> noise_variance,
                         double noise_dof) noexcept {
  prior_ = prior;
  known_ = true;
  std::size_t index = 0;
  for (const ModePole& pole : prior_.known()) {
    const double size = std::abs(pole.sigma_rad_s);
    most_variance_[index] =
        std::pow((pole.real() ? least_known_real : least_known_decay) * size, 2);
    if (!pole.real()) {
      most_variance_[index + 1] = std::pow(least_known_turn * pole.omega_rad_s, 2);
    }
    index += pole.size();
  }
  limit_doubt();
  for (std::size_t i = 0; i < prior_.parameters(); ++i) {
    most_variance_[i] = prior_.covariance[triangle(i) + i];
  }
  for (std::size_t i = 0; i < noise_.size(); ++i) noise_[i] = {noise_variance[i], noise_dof};
}

// Forgetting must not make a pole that dwells hardly see less known than it was at first: it would
// wander off and become a trend.
void ModalSettling::limit_doubt() noexcept {
  const std::size_t parameters = prior_.parameters();
  for (std::size_t i = 0; i < parameters; ++i) {
    const double variance = prior_.covariance[triangle(i) + i];
    if (!(variance > most_variance_[i])) continue;
    const double scale = std::sqrt(most_variance_[i] / variance);
    for (std::size_t j = 0; j < parameters; ++j) {
      prior_.covariance[j <= i ? triangle(i) + j : triangle(j) + i] *=
          j == i ? scale * scale : scale;
    }
  }
}

// The precision of the poles by inverting their covariance.
void ModalSettling::believe() noexcept {
  const std::size_t parameters = prior_.parameters();
  NormalSums& scratch = inverse_sums_;
  std::copy_n(prior_.covariance.begin(), triangle(parameters), scratch.gram.begin());
  belief_ = {};
  if (!inverse_.factor(scratch.gram, parameters)) {
    // Dependent poles: each by itself.
    for (std::size_t i = 0; i < parameters; ++i) {
      belief_.precision[triangle(i) + i] = 1.0 / prior_.covariance[triangle(i) + i];
    }
    return;
  }
  for (std::size_t i = 0; i < parameters; ++i) {
    std::span<double> column{scratch.moments.data(), parameters};
    std::fill(column.begin(), column.end(), 0.0);
    column[i] = 1.0;
    inverse_.solve(column);
    for (std::size_t j = 0; j <= i; ++j) belief_.precision[triangle(i) + j] = column[j];
  }
}

void ModalSettling::start(const ModalTask& task) noexcept {
  task_ = task;
  std::copy(prior_.poles.begin(), prior_.poles.end(), poles_.begin());
  believe();
  relinearise_regression();
  block_count_ = 0;
  block_length_ = std::max(shortest_block, task.least_samples / blocks_per_window);
  blocks_end_ = 0;
  blocks_.edge[0] = 0;
  linearisations_ = 0;
  doubted_poles_ = false;
  doubt_ = ModalDoubt::none;
  solution_ = {};
  for (ModalResult& result : results_) result = {};
}

void ModalSettling::relinearise_regression() noexcept {
  regression_.linearise({poles_.data(), prior_.modes}, 1.0 / rate_hz_, task_.omega_rad_s);
}

void ModalSettling::accumulate(const ModalStore& store, std::size_t channel, std::uint64_t begin,
                               std::uint64_t end, ModalSums& sums) noexcept {
  sums.clear(regression_.columns());
  ModalSample sample;
  for (std::uint64_t at = begin; at < end; ++at) {
    const bool there = store.sample(channel, at, sample);
    regression_.go_to(at);
    if (there) regression_.add(sample, sums);
  }
}

// Every two blocks become one.
void ModalSettling::merge() noexcept {
  const std::size_t columns = regression_.columns();
  const std::size_t odd = block_count_ % 2;
  // The oldest stays alone where there is an odd number.
  std::size_t to = odd;
  for (std::size_t from = odd; from + 1 < block_count_; from += 2, ++to) {
    blocks_.sums[from].add(blocks_.sums[from + 1], columns);
    if (to != from) blocks_.sums[to] = blocks_.sums[from];
    blocks_.edge[to + 1] = blocks_.edge[from + 2];
  }
  block_count_ = to;
  block_length_ *= 2;
}

void ModalSettling::total(std::size_t from, ModalSums& sums) const noexcept {
  const std::size_t columns = regression_.columns();
  sums.clear(columns);
  for (std::size_t i = from; i < block_count_; ++i) sums.add(blocks_.sums[i], columns);
}

bool ModalSettling::solve_window() noexcept {
  std::size_t index = 0;
  for (std::size_t i = 0; i < prior_.modes; ++i) {
    belief_.mean[index] = prior_.poles[i].sigma_rad_s - poles_[i].sigma_rad_s;
    if (!poles_[i].real()) {
      belief_.mean[index + 1] = prior_.poles[i].omega_rad_s - poles_[i].omega_rad_s;
    }
    index += poles_[i].size();
  }
  total(0, window_);
  return solver_.solve(window_, {poles_.data(), prior_.modes}, belief_, expected_noise(0),
                       solution_);
}

bool ModalSettling::needs_other_poles() const noexcept {
  const double sigma = std::sqrt(expected_noise(0));
  const auto begin = static_cast<double>(blocks_.edge[0]);
  const double seconds =
      static_cast<double>(blocks_.edge[block_count_] - blocks_.edge[0]) / rate_hz_;
  std::size_t index = 0;
  for (std::size_t i = 0; i < prior_.modes; ++i) {
    const ModePole& pole = poles_[i];
    const double* a = &solution_.amplitudes[index];
    const double* d = &solution_.moved[index];
    const double size = pole.real() ? std::abs(a[0]) : std::hypot(a[0], a[1]);
    const double move = pole.real() ? std::abs(d[0]) : std::hypot(d[0], d[1]);
    index += pole.size();
    // Amplitudes are those at the start of the dwell.
    const double left = size * std::exp(pole.sigma_rad_s * begin / rate_hz_);
    const double decay = pole.sigma_rad_s < 0.0 ? -2.0 / pole.sigma_rad_s : seconds;
    const double te = std::min(seconds, decay);
    const double turned = move * (te + begin / rate_hz_);
    if (turned > far_rad &&
        left * turned * turned / 2.0 * std::sqrt(te * rate_hz_ / 2.0) > seen_sigmas * sigma) {
      return true;
    }
  }
  return false;
}

void ModalSettling::linearise_again(const ModalStore& store, std::size_t channel) noexcept {
  std::size_t index = 0;
  for (std::size_t i = 0; i < prior_.modes; ++i) {
    const ModePole& known = prior_.poles[i];
    const double sigma = poles_[i].sigma_rad_s + solution_.moved[index];
    const double a = least_damping_factor * known.sigma_rad_s;
    const double b = most_damping_factor * known.sigma_rad_s;
    poles_[i].sigma_rad_s = std::clamp(sigma, std::min(a, b), std::max(a, b));
    if (!known.real()) {
      const double omega = poles_[i].omega_rad_s + solution_.moved[index + 1];
      poles_[i].omega_rad_s = std::clamp(omega, 0.5 * known.omega_rad_s, 2.0 * known.omega_rad_s);
    }
    index += known.size();
  }
  relinearise_regression();
  for (std::size_t i = 0; i < block_count_; ++i) {
    accumulate(store, channel, blocks_.edge[i], blocks_.edge[i + 1], blocks_.sums[i]);
  }
}

// What the residual of the window may be: the noise, or a part of the target so small that no
// transient of its size matters. Nothing real is linear to 120 dB.
double ModalSettling::expected_noise(std::size_t output) const noexcept {
  const double mean = window_.moments[2] / window_.count;
  const double power = std::max(0.0, window_.square / window_.count - mean * mean);
  const double target =
      std::min(task_.target_db > 0.0 ? task_.target_db / db_per_relative : 1.0,
               task_.target_deg > 0.0 ? task_.target_deg / degrees_per_radian : 1.0);
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
      memories_[output].pooled(estimate, task_.omega_rad_s / (2.0 * std::numbers::pi));
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

// Hausman's test: the late half is free of what a wrong model of the transient does to the whole.
bool ModalSettling::late_half_agrees() noexcept {
  const std::uint64_t middle = (blocks_.edge[0] + blocks_.edge[block_count_]) / 2;
  std::size_t from = 0;
  while (from + 1 < block_count_ && blocks_.edge[from] < middle) ++from;
  total(from, cluster_);
  if (!solver_.solve(cluster_, {poles_.data(), prior_.modes}, belief_, expected_noise(0), late_)) {
    return true;
  }
  const double variance = noise_of_window(0, solution_);
  const double shift = std::abs(late_.tone - solution_.tone);
  const double gained =
      variance * (largest_eigenvalue(late_.covariance) - largest_eigenvalue(solution_.covariance));
  const double target =
      std::min(task_.target_db > 0.0 ? task_.target_db / db_per_relative : 1.0,
               task_.target_deg > 0.0 ? task_.target_deg / degrees_per_radian : 1.0);
  return shift <= std::max(late_part_of_target * target * std::abs(solution_.tone),
                           late_sigmas * std::sqrt(std::max(0.0, gained)));
}

// Solved, linear where the poles stand. False where the window does not determine the tone.
bool ModalSettling::settle_poles(const ModalStore& store) noexcept {
  if (!solve_window()) return false;
  for (int again = 0;
       again < most_at_once && needs_other_poles() && linearisations_ < most_linearisations;
       ++again) {
    ++linearisations_;
    linearise_again(store, outputs_[0]);
    if (!solve_window()) return false;
  }
  return true;
}

// The modes may be right and their poles have moved further than was believed: once a dwell they
// are looked for from the beginning, with less belief in what was known of them.
void ModalSettling::doubt_poles(const ModalStore& store) noexcept {
  doubted_poles_ = true;
  for (double& each : belief_.precision) each /= doubted_variance;
  linearisations_ = 0;
  std::copy(prior_.poles.begin(), prior_.poles.end(), poles_.begin());
  relinearise_regression();
  for (std::size_t i = 0; i < block_count_; ++i) {
    accumulate(store, outputs_[0], blocks_.edge[i], blocks_.edge[i + 1], blocks_.sums[i]);
  }
}

ModalVerdict ModalSettling::decide(const ModalStore& store) noexcept {
  if (!settle_poles(store)) return not_determined();
  if (!residual_explained(0) && !doubted_poles_) {
    doubt_poles(store);
    if (!settle_poles(store)) return not_determined();
  }
  if (!residual_explained(0)) {
    doubt_ = ModalDoubt::residual;
    return ModalVerdict::abandoned;
  }
  const std::uint64_t length = blocks_.edge[block_count_] - blocks_.edge[0];
  if (length < task_.least_samples) return ModalVerdict::going_on;
  const double white = noise_of_window(0, solution_) * largest_eigenvalue(solution_.covariance) /
                       std::norm(solution_.tone);
  const double wanted =
      std::min(task_.target_db > 0.0 ? task_.target_db / db_per_relative : 1.0,
               task_.target_deg > 0.0 ? task_.target_deg / degrees_per_radian : 1.0);
  if (4.0 * white > 2.0 * wanted * wanted) return ModalVerdict::going_on;
  if (!fit_input(store)) return ModalVerdict::going_on;
  if (input_residual_ > std::pow(harmonics_part_of_target * wanted, 2)) {
    doubt_ = ModalDoubt::not_a_sine;
    return ModalVerdict::abandoned;
  }
  if (!fill_result(store, 0)) return ModalVerdict::going_on;
  if (!(target_excess() <= 1.0)) return ModalVerdict::going_on;
  solver_.pole_covariance({posterior_.data(), triangle(prior_.parameters())});
  if (!late_half_agrees()) {
    // The oldest quarter goes.
    const std::size_t drop = std::max<std::size_t>(1, block_count_ / 4);
    if (block_count_ > drop + 1) {
      for (std::size_t i = drop; i < block_count_; ++i) blocks_.sums[i - drop] = blocks_.sums[i];
      for (std::size_t i = drop; i <= block_count_; ++i) blocks_.edge[i - drop] = blocks_.edge[i];
      block_count_ -= drop;
    }
    return ModalVerdict::going_on;
  }
  move_prior();
  learn_noise(0);
  if (!take_other_outputs(store)) {
    doubt_ = ModalDoubt::residual;
    return ModalVerdict::abandoned;
  }
  return ModalVerdict::accepted;
}

// A window that is long enough by now and still says nothing never will.
ModalVerdict ModalSettling::not_determined() noexcept {
  const std::uint64_t enough = patient_windows * task_.least_samples + patient_samples;
  if (blocks_end_ < enough) return ModalVerdict::going_on;
  doubt_ = ModalDoubt::undetermined;
  return ModalVerdict::abandoned;
}

bool ModalSettling::residual_explained(std::size_t output) const noexcept {
  const double dof = solution_.samples - solution_.unknowns;
  const double known = std::max(1.0, noise_[output].dof);
  const double excess = solution_.residual_variance() / expected_noise(output) - 1.0;
  return dof < least_dof || excess <= residual_sigmas * std::sqrt(2.0 / dof + 2.0 / known);
}

// The first output has judged the dwell; the others are solved over the same window, with the poles
// as it has left them. The blocks are theirs from here on.
bool ModalSettling::take_other_outputs(const ModalStore& store) noexcept {
  const ModalSolution first = solution_;
  bool explained = true;
  for (std::size_t output = 1; output < outputs_.size(); ++output) {
    std::copy(prior_.poles.begin(), prior_.poles.end(), poles_.begin());
    believe();
    relinearise_regression();
    for (std::size_t i = 0; i < block_count_; ++i) {
      accumulate(store, outputs_[output], blocks_.edge[i], blocks_.edge[i + 1], blocks_.sums[i]);
    }
    total(0, window_);
    if (!solver_.solve(window_, {poles_.data(), prior_.modes}, belief_, expected_noise(output),
                       solution_)) {
      explained = false;
      continue;
    }
    explained = explained && residual_explained(output);
    fill_result(store, output);
    learn_noise(output);
  }
  solution_ = first;
  return explained;
}

ModalVerdict ModalSettling::look(const ModalStore& store, std::uint64_t count) noexcept {
  while (next_look() <= count) {
    if (block_count_ == most_blocks) merge();
    if (next_look() > count) break;
    const std::uint64_t end = next_look();
    accumulate(store, outputs_[0], blocks_end_, end, blocks_.sums[block_count_]);
    blocks_end_ = end;
    blocks_.edge[++block_count_] = blocks_end_;
    if (end - blocks_.edge[0] < task_.least_samples) continue;
    const ModalVerdict verdict = decide(store);
    if (verdict != ModalVerdict::going_on) return verdict;
  }
  if (count == store.capacity()) {
    doubt_ = ModalDoubt::store_full;
    return ModalVerdict::abandoned;
  }
  return ModalVerdict::going_on;
}

void ModalSettling::conclude(const ModalStore& store) noexcept {
  if (block_count_ == 0 || doubt_ != ModalDoubt::none) return;
  if (!solve_window() || !fit_input(store)) return;
  if (fill_result(store, 0)) take_other_outputs(store);
}

// What the dwell has taught of the poles is where the next begins.
void ModalSettling::move_prior() noexcept {
  std::size_t index = 0;
  for (std::size_t i = 0; i < prior_.modes; ++i) {
    const double sigma = poles_[i].sigma_rad_s + solution_.moved[index];
    if (sigma < 0.0 || prior_.poles[i].sigma_rad_s >= 0.0) prior_.poles[i].sigma_rad_s = sigma;
    if (!poles_[i].real()) {
      prior_.poles[i].omega_rad_s = poles_[i].omega_rad_s + solution_.moved[index + 1];
    }
    index += poles_[i].size();
  }
  for (std::size_t i = 0; i < triangle(prior_.parameters()); ++i) {
    prior_.covariance[i] = forgetting * posterior_[i];
  }
  limit_doubt();
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
