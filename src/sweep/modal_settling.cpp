#include "sweep/modal_settling.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sinerig {

namespace {

constexpr std::uint64_t shortest_block = 8;
constexpr std::uint64_t blocks_per_window = 16;

// More is left than the noise explains, in standard errors of a variance: at 4 none of 6000 dwells
// with the right modes was doubted.
constexpr double residual_sigmas = 4.0;

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

double largest_eigenvalue(const Covariance2& c) noexcept {
  const double half = 0.5 * (c.re_re + c.im_im);
  const double apart = 0.5 * (c.re_re - c.im_im);
  return half + std::sqrt(apart * apart + c.re_im * c.re_im);
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
  const double target = task_.relative_target();
  return shift <= std::max(late_part_of_target * target * std::abs(solution_.tone),
                           late_sigmas * std::sqrt(std::max(0.0, gained)));
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
  const double wanted = task_.relative_target();
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

}  // namespace sinerig
