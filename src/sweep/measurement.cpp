#include "sweep/measurement.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <utility>

namespace sinerig {

namespace {

// Checkpoints of a dwell: enough to drop an eighth of a short window, few enough to keep.
constexpr std::size_t max_checkpoints = 65;

// A dwell measured both ways disagrees: in sigma of both, and as a part of the target. At 4 one
// check of 3000 does by chance.
constexpr double checked_sigmas = 4.0;
constexpr double checked_part_of_target = 0.5;

// rad/s; one formula, so that what is recalled is what was learnt to the last bit.
double angular_frequency(const Dwell& dwell, const Tone& tone, double rate_hz) {
  const double per_cycle =
      2.0 * std::numbers::pi * rate_hz / static_cast<double>(dwell.block_samples);
  return per_cycle * static_cast<double>(tone.cycles);
}

}  // namespace

std::vector<std::size_t> outputs_of(const Pairs& pairs) {
  std::vector<std::size_t> outputs;
  for (const Pair& pair : pairs) outputs.push_back(pair.output);
  return outputs;
}

Measurement::Measurement(std::size_t channels, std::size_t max_bins, std::size_t max_tones,
                         Pairs pairs, Judgement judgement, double rate_hz)
    : pairs_{std::move(pairs)},
      judgement_{judgement},
      rate_hz_{rate_hz},
      max_tones_{max_tones},
      regression_{channels, max_bins, max_checkpoints, max_parts},
      estimator_{max_bins},
      memories_(pairs_.size()),
      results_(pairs_.size() * max_tones),
      estimates_(max_tones),
      strays_(max_tones),
      transients_(pairs_.size()),
      omega_(max_bins),
      block_missing_(channels),
      modelled_(pairs_.size()) {
  if (judgement_.settling != Settling::model) return;
  modal_ = std::make_unique<ModalDwell>(channels, outputs_of(pairs_), rate_hz);
}

void Measurement::solve_elsewhere() {
  if (modal_) modal_->solve_elsewhere();
}

void Measurement::know(const ModePrior& prior, std::span<const double> noise_variance,
                       double noise_dof) noexcept {
  if (modal_) modal_->know(prior, noise_variance, noise_dof);
}

void Measurement::start(const Dwell& dwell, const Beginning& beginning) noexcept {
  dwell_ = &dwell;
  by_detection_ = beginning.by_detection;
  foreseen_ = taught_ && !beginning.from_rest;
  std::size_t bin = 0;
  for (const Tone& tone : dwell.tones) omega_[bin++] = angular_frequency(dwell, tone, rate_hz_);
  for (std::uint32_t order = 2; order <= dwell.harmonics; ++order)
    omega_[bin++] = order * omega_[0];
  if (dwell.bias_hz > 0.0) omega_[bin++] = 2.0 * std::numbers::pi * dwell.bias_hz;
  regression_.start({omega_.data(), dwell.bins()}, 1.0 / rate_hz_,
                    static_cast<double>(dwell.block_samples),
                    dwell.bias_hz > 0.0 ? 0 : dwell.parts);
  taught_ = false;
  restart();
}

void Measurement::restart() noexcept {
  samples_ = 0;
  part_ = 0;
  in_block_ = 0;
  next_look_ = 0;
  first_ = 0;
  stride_ = 1;
  block_ended_ = false;
  std::fill(block_missing_.begin(), block_missing_.end(), 0);
  std::fill(results_.begin(), results_.end(),
            Result{.still = judgement_.settling == Settling::fixed});
  whole_blocks_ = judgement_.settling == Settling::fixed;
  done_ = false;
  regression_.begin_block();
  start_modal();
}

void Measurement::start_modal() noexcept {
  by_model_ = false;
  at_limit_ = false;
  checking_ = false;
  check_.reset();
  if (!modal_) return;
  if (by_detection_ || !modal_->knows() || dwell_->tones.size() > 1 || dwell_->bias_hz > 0.0) {
    modal_->leave();
    return;
  }
  const std::uint64_t waited = dwell_->settle_samples;
  modal_->start(
      {.omega_rad_s = omega_[0],
       .cycle_samples = dwell_->block_samples / dwell_->tones.front().cycles,
       .least_samples = dwell_->least_samples > waited ? dwell_->least_samples - waited : 1,
       .target_db = judgement_.target_db,
       .target_deg = judgement_.target_deg});
}

void Measurement::take_modal() noexcept {
  by_model_ = true;
  for (std::size_t pair = 0; pair < pairs_.size(); ++pair) {
    const ModalResult& from = modal_->result(pair);
    Result& to = result(pair, 0);
    to = {};
    to.estimate = from.estimate;
    to.variance = from.variance;
    to.still = true;
    to.known = from.known;
  }
}

void Measurement::disturb() noexcept {
  foreseen_ = false;
  regression_.forget();
  restart();
}

void Measurement::add(std::span<const Phasor> phasors,
                      std::span<const Observation> observations) noexcept {
  if (block_ended_) {
    block_ended_ = false;
    std::fill(block_missing_.begin(), block_missing_.end(), 0);
    regression_.begin_block();
  }
  begins_ = in_block_ == 0;
  regression_.add(phasors, observations);
  for (std::size_t channel = 0; channel < observations.size(); ++channel) {
    if (observations[channel].missing) ++block_missing_[channel];
  }
  ++samples_;
  ++in_block_;
  // Part k of a block ends at the sample nearest below (k + 1) / parts of it.
  if (in_block_ * dwell_->parts >= (part_ + 1) * dwell_->block_samples) end_part();
  if (!done_ && modal_ && modal_->live()) {
    modal_->add(phasors[0], observations);
    if (modal_->accepted()) end_modelled();
  }
  // What its model has to say may take some ticks more.
  if (at_limit_ && !done_ && (!modal_ || modal_->concluded())) {
    conclude();
    done_ = true;
  }
}

// The model has ended the dwell, but for one that is drawn to be measured both ways.
void Measurement::end_modelled() noexcept {
  take_modal();
  if (!drawn()) {
    done_ = true;
    return;
  }
  for (std::size_t pair = 0; pair < pairs_.size(); ++pair) {
    modelled_[pair] = result(pair, 0);
    result(pair, 0).still = false;  // until it is seen
  }
  by_model_ = false;
  checking_ = true;
}

// As good as random, yet a function of the samples: the lowest bits of what was measured.
bool Measurement::drawn() const noexcept {
  auto bits = std::bit_cast<std::uint64_t>(result(0, 0).estimate.response.real());
  // SplitMix64 (Steele, Lea and Flood 2014).
  bits += 0x9e3779b97f4a7c15U;
  bits = (bits ^ (bits >> 30U)) * 0xbf58476d1ce4e5b9U;
  bits = (bits ^ (bits >> 27U)) * 0x94d049bb133111ebU;
  bits ^= bits >> 31U;
  return std::ldexp(static_cast<double>(bits >> 11U), -53) < judgement_.check_fraction;
}

void Measurement::take_back_modelled() noexcept {
  for (std::size_t pair = 0; pair < pairs_.size(); ++pair) result(pair, 0) = modelled_[pair];
  by_model_ = true;
  at_limit_ = false;  // its model had ended it
}

// What the model has said and what is seen now that the transient has gone. Where it has not, or
// where less is known so late than the model knew and both agree, the model's word stands.
void Measurement::hold_against_model() noexcept {
  bool gone = true;
  bool enough = true;
  for (std::size_t pair = 0; pair < pairs_.size(); ++pair) {
    gone = gone && (result(pair, 0).still || !result(pair, 0).known);
    enough = enough && (result(pair, 0).known || !modelled_[pair].known) && target_met(pair);
  }
  if (!gone) {
    take_back_modelled();
    return;
  }
  check_ = Check{};
  for (std::size_t pair = 0; pair < pairs_.size(); ++pair) {
    const Result& one = modelled_[pair];
    const Result& other = result(pair, 0);
    if (!one.known || !other.known) continue;
    const double gain = std::abs(other.estimate.response);
    const double apart = std::abs(one.estimate.response - other.estimate.response) / gain;
    const double noise = std::sqrt(one.variance.covariance.mean_variance() +
                                   other.variance.covariance.mean_variance()) /
                         gain;
    const bool agrees = apart <= std::max(checked_part_of_target * judgement_.relative_target(),
                                          checked_sigmas * std::hypot(noise, other.left));
    check_->agrees = check_->agrees && agrees;
    check_->disagreement = std::max(check_->disagreement, apart);
  }
  if (check_->agrees && !enough) take_back_modelled();
}

void Measurement::end_part() noexcept {
  ++part_;
  const bool kept = regression_.checkpoint();
  if (in_block_ == dwell_->block_samples) {
    part_ = 0;
    in_block_ = 0;
    block_ended_ = true;
  }
  if (kept && !done_) judge();
  if (samples_ + dwell_->settle_samples >= dwell_->max_samples && !done_) at_limit_ = true;
}

std::optional<ChannelContent> Measurement::block_content(std::size_t channel) noexcept {
  const std::size_t last = regression_.checkpoints() - 1;
  const std::size_t per_block = dwell_->parts / regression_.stride();
  if (per_block == 0 || last < per_block) return std::nullopt;
  auto found = estimator_.content(regression_, {.first = last - per_block, .last = last}, channel,
                                  dwell_->tones.size(), dwell_->harmonic_bins());
  if (!found) return std::nullopt;
  const auto offset_ns = static_cast<double>(regression_.common_offset_ns(channel));
  found->first_tone *= std::polar(1.0, -omega_[0] * offset_ns * 1e-9);
  return found;
}

void Measurement::conclude() noexcept {
  if (dwell_ == nullptr || done_) return;
  if (modal_ && !checking_ && modal_->conclude()) {
    take_modal();
    return;
  }
  const Window window = current_window();
  if (window.last == window.first) {
    if (checking_) hold_against_model();
    return;
  }
  taught_ = true;
  for (std::size_t pair = 0; pair < pairs_.size(); ++pair) {
    if (!evaluate(pair, window)) continue;
    if (dwell_->tones.size() == 1) {
      const Estimate& single = result(pair, 0).estimate;
      transients_[pair].learn(single.response, omega_[0], std::abs(single.input));
    }
    for (std::size_t tone = 0; tone < dwell_->tones.size(); ++tone) {
      Result& each = result(pair, tone);
      memories_[pair].learn(each.estimate, omega_[tone] / (2.0 * std::numbers::pi));
    }
  }
  if (checking_) hold_against_model();
}

std::optional<Lesson> Measurement::lesson(std::size_t pair, std::size_t tone) const noexcept {
  const Result& each = result(pair, tone);
  if (!taught_ || !each.known) return std::nullopt;
  const Estimate& estimate = each.estimate;
  return Lesson{.tone = static_cast<std::uint16_t>(tone),
                .pair = static_cast<std::uint16_t>(pair),
                .response = estimate.response,
                .input_amplitude = std::abs(estimate.input),
                .white = estimate.white.mean_variance(),
                .scatter = estimate.scatter,
                .scatter_dof = estimate.scatter_dof,
                .residual_rms = estimate.residual_rms};
}

void Measurement::recall(const Lesson& lesson, const Dwell& dwell) noexcept {
  const double omega_rad_s = angular_frequency(dwell, dwell.tones[lesson.tone], rate_hz_);
  if (dwell.tones.size() == 1) {
    transients_[lesson.pair].learn(lesson.response, omega_rad_s, lesson.input_amplitude);
  }
  Estimate estimate{};
  estimate.white = {.re_re = lesson.white, .re_im = 0.0, .im_im = lesson.white};
  estimate.scatter = lesson.scatter;
  estimate.scatter_dof = lesson.scatter_dof;
  estimate.residual_rms = lesson.residual_rms;
  memories_[lesson.pair].learn(estimate, omega_rad_s / (2.0 * std::numbers::pi));
}

}  // namespace sinerig
