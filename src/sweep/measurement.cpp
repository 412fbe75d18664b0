#include "sweep/measurement.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace sinerig {

namespace {

constexpr double db_per_relative = 20.0 / std::numbers::ln10;
constexpr double degrees_per_radian = 180.0 / std::numbers::pi;

// The regression's channel of what was applied.
constexpr std::size_t applied_row = 0;

// Checkpoints of a dwell: enough to drop a quarter of a short window, few enough to keep.
constexpr std::size_t max_checkpoints = 65;

// Clusters of a window at most.
constexpr std::size_t most_clusters = 64;

// A window of fewer blocks is cut into half blocks: twice the degrees of freedom where they are
// dear. With whole cycles g4 took 77 s instead of 66 s at 20 dB; quarters covered 92 % at 80 dB.
constexpr std::size_t few_blocks = 8;

// The late half of a settled window strays from the whole by chance: allowed in multiples of the
// rms of that shift. At 2 a settled window is doubted once in 55 looks, at 1.5 once in 10, which
// cost a fifth more time on g4 at 20 dB.
constexpr double settling_sigmas = 2.0;

// … and by this part of the target whatever the noise. At 0.2 every tenth sweep of g2 had a point
// beyond 0.1 dB at 80 dB.
constexpr double settling_part_of_target = 0.05;

// A window is at least this long, as a multiple of the time it waited for: what is left of a
// transient after that time decays slowly, and a short window doesn't see it move. At 0.75 a fourth
// of the sweeps of g2 at 80 dB missed 0.1 dB, at 1 one in 20.
constexpr double window_per_wait = 1.25;

// A shift within the noise may hide this part of it; the rest of the noise is in the variance. At
// 0.25 the phase of g1 and g2 at 80 dB was covered 92.7 %, at 0.5 95.1 and 94.5 %.
constexpr double hidden_part = 0.5;

// Windows of fewer blocks can't tell a fast transient from noise: there the noise is taken to be at
// most this multiple of the dwell's before.
constexpr std::size_t blocks_that_know_noise = 6;
constexpr double noise_growth = 1.5;

// The colour of the noise counts in the judgement of a shift once more degrees of freedom than
// these are behind it; a transient colours the residual too.
constexpr double colour_dof = 10.0;

// Looks are taken when the window has grown by this part: every look is one more chance to be
// fooled.
constexpr std::uint64_t looks_per_length = 32;

// The tolerance of settling where no target sets one.
constexpr double default_settling_tolerance = 1e-3;

// One cluster this much louder than the others is a burst, if it also stands out statistically.
// At 6 the end of a transient was taken for a burst in 2 of 1000 clean points.
constexpr double burst_ratio = 25.0;

// rad/s; one formula, so that what is recalled is what was learnt to the last bit.
double angular_frequency(const Dwell& dwell, const Tone& tone, double rate_hz) {
  const double per_cycle =
      2.0 * std::numbers::pi * rate_hz / static_cast<double>(dwell.block_samples);
  return per_cycle * static_cast<double>(tone.cycles);
}

// A modelled dwell is kept for this long. One that takes longer is limited by noise, not by its
// transient: detection costs little there.
constexpr std::size_t most_stored = std::size_t{1} << 19U;

}  // namespace

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
      omega_(max_bins) {
  if (judgement_.settling != Settling::model) return;
  std::vector<std::size_t> outputs;
  for (const Pair& pair : pairs_) outputs.push_back(pair.output);
  modal_ = std::make_unique<ModalSettling>(std::move(outputs), rate_hz);
  store_ = std::make_unique<ModalStore>(channels, most_stored);
  solver_ = make_solver(Deputy::Where::at_once);
}

std::unique_ptr<Deputy> Measurement::make_solver(Deputy::Where where) {
  return std::make_unique<Deputy>([this] { verdict_ = modal_->look(*store_, look_count_); }, where);
}

void Measurement::solve_elsewhere() {
  if (modal_) solver_ = make_solver(Deputy::Where::own_thread);
}

void Measurement::know(const ModePrior& prior, std::span<const double> noise_variance,
                       double noise_dof) noexcept {
  if (modal_) modal_->know(prior, noise_variance, noise_dof);
}

void Measurement::start(const Dwell& dwell) noexcept {
  dwell_ = &dwell;
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
  block_complete_ = true;
  block_ended_ = false;
  std::fill(results_.begin(), results_.end(),
            Result{.still = judgement_.settling == Settling::fixed});
  whole_blocks_ = judgement_.settling == Settling::fixed;
  done_ = false;
  regression_.begin_block();
  start_modal();
}

void Measurement::start_modal() noexcept {
  by_model_ = false;
  refuted_ = false;
  modal_live_ = modal_ && modal_->knows() && dwell_->tones.size() == 1 && dwell_->bias_hz == 0.0;
  if (!modal_live_) return;
  waiting_ = !solver_->idle();
  if (!waiting_) begin_modal();
}

void Measurement::begin_modal() noexcept {
  waiting_ = false;
  looking_ = false;
  store_->clear();
  blind_left_ = modal_->prior().blind_ticks;
  const std::uint64_t before = dwell_->settle_samples + blind_left_;
  modal_->start(
      {.omega_rad_s = omega_[0],
       .cycle_samples = dwell_->block_samples / dwell_->tones.front().cycles,
       .least_samples = dwell_->least_samples > before ? dwell_->least_samples - before : 1,
       .target_db = judgement_.target_db,
       .target_deg = judgement_.target_deg});
}

void Measurement::add_modal(Phasor tone, std::span<const Observation> observations) noexcept {
  if (waiting_ && solver_->idle()) begin_modal();
  if (waiting_) return;
  if (blind_left_ > 0) {
    --blind_left_;
    return;
  }
  store_->add(tone, observations);
  if (looking_ && solver_->idle()) hear_verdict();
  if (looking_ || !modal_live_) return;
  if (store_->count() < modal_->next_look() && !store_->full()) return;
  look_count_ = store_->count();
  looking_ = true;
  solver_->ask();
  if (solver_->idle()) hear_verdict();
}

void Measurement::hear_verdict() noexcept {
  looking_ = false;
  if (verdict_ == ModalVerdict::going_on) return;
  modal_live_ = false;
  if (verdict_ == ModalVerdict::abandoned) {
    refuted_ = modal_->doubt() == ModalDoubt::residual;
    return;
  }
  take_modal();
  done_ = true;
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
  regression_.forget();
  restart();
}

void Measurement::add(std::span<const Phasor> phasors,
                      std::span<const Observation> observations) noexcept {
  if (block_ended_) {
    block_ended_ = false;
    block_complete_ = true;
    regression_.begin_block();
  }
  regression_.add(phasors, observations);
  for (const Observation& each : observations) block_complete_ = block_complete_ && !each.missing;
  ++samples_;
  ++in_block_;
  // Part k of a block ends at the sample nearest below (k + 1) / parts of it.
  if (in_block_ * dwell_->parts >= (part_ + 1) * dwell_->block_samples) end_part();
  if (modal_live_ && !done_) add_modal(phasors[0], observations);
}

void Measurement::end_part() noexcept {
  ++part_;
  const bool kept = regression_.checkpoint();
  if (in_block_ == dwell_->block_samples) {
    part_ = 0;
    in_block_ = 0;
    block_ended_ = block_complete_;
    if (!block_complete_) {
      block_complete_ = true;
      regression_.begin_block();
    }
  }
  if (kept) judge();
  if (samples_ + dwell_->settle_samples >= dwell_->max_samples && !done_) {
    conclude();
    done_ = true;
  }
}

Window Measurement::current_window() noexcept {
  while (stride_ < regression_.stride()) {
    stride_ *= 2;
    first_ = (first_ + 1) / 2;
  }
  const std::size_t last = regression_.checkpoints() - 1;
  const std::size_t per_block = std::max<std::size_t>(1, dwell_->parts / stride_);
  const std::size_t blocks = (last - first_) / per_block;
  Window window{.first = first_, .last = last, .settled = judgement_.settling == Settling::fixed};
  if (whole_blocks_ && blocks > 0) {
    window.first = last - blocks * per_block;
    window.block = per_block;
  }
  const std::size_t merged = (blocks + most_clusters - 1) / most_clusters;
  window.cluster = blocks < few_blocks ? std::max<std::size_t>(1, per_block / 2)
                                       : per_block * std::max<std::size_t>(1, merged);
  return window;
}

bool Measurement::evaluate(std::size_t pair, const Window& window) noexcept {
  const std::size_t tones = dwell_->tones.size();
  const bool solved =
      estimator_.estimate(regression_, window, pairs_[pair], {omega_.data(), dwell_->bins()},
                          dwell_->harmonic_bins(), {estimates_.data(), tones});
  for (std::size_t tone = 0; tone < tones; ++tone) {
    Result& each = result(pair, tone);
    each.known = solved;
    if (!solved) continue;
    each.estimate = estimates_[tone];
    each.variance = memories_[pair].pooled(each.estimate, omega_[tone] / (2.0 * std::numbers::pi));
  }
  return solved;
}

double Measurement::settling_tolerance() const noexcept {
  const double gain = judgement_.target_db / db_per_relative;
  const double phase = judgement_.target_deg / degrees_per_radian;
  if (gain > 0.0 && phase > 0.0) return settling_part_of_target * std::min(gain, phase);
  if (judgement_.has_target()) return settling_part_of_target * std::max(gain, phase);
  return default_settling_tolerance;
}

// Were the window free of the transient, its late half would stray from the whole only by noise
// (Hausman's test). Nor can the transient have left more than it began with, averaged over the
// radians that it turned against the tone.
void Measurement::look_for_transient(std::size_t pair, const Window& window) noexcept {
  const std::size_t per_block = std::max<std::size_t>(1, dwell_->parts / stride_);
  const std::size_t blocks = (window.last - window.first) / per_block;
  // Half of the window in whole blocks, which see no harmonics; half of a short one.
  const std::size_t half = blocks >= 2 ? blocks / 2 * per_block : (window.last - window.first) / 2;
  const double most_noise = blocks < blocks_that_know_noise
                                ? noise_growth * memories_[pair].last_rms()
                                : std::numeric_limits<double>::infinity();
  const std::size_t tones = dwell_->tones.size();
  const bool known =
      estimator_.stray(regression_, window, window.last - half, pairs_[pair], most_noise,
                       {estimates_.data(), tones}, {strays_.data(), tones});
  const double seconds = static_cast<double>(regression_.samples_at(window.last) -
                                             regression_.samples_at(window.first)) /
                         rate_hz_;
  for (std::size_t tone = 0; tone < tones; ++tone) {
    Result& whole = result(pair, tone);
    whole.still = false;
    if (!known) continue;
    const double white = whole.estimate.white.mean_variance();
    const double dof = whole.variance.dof;
    const double seen = white > 0.0 ? whole.variance.covariance.mean_variance() / white : 1.0;
    const double colour = (dof * seen + colour_dof) / (dof + colour_dof);
    whole.late = strays_[tone];
    whole.late.noise *= std::sqrt(colour);
    TransientBound bound;
    if (tones == 1) {
      bound = transients_[pair].bound(whole.estimate.response, omega_[tone],
                                      std::abs(whole.estimate.input));
    }
    const double shift = whole.late.shift;
    const double noise = whole.late.noise;
    const bool moves = shift > settling_sigmas * noise;
    const double shown = moves ? std::sqrt(shift * shift - noise * noise) : hidden_part * noise;
    const double turned = bound.rate_rad_s * seconds;
    whole.left = std::min(shown, turned > 2.0 ? bound.size * 2.0 / turned : bound.size);
    whole.still = !(moves && whole.left > settling_tolerance());
  }
}

// Every pair: the transient of one may be all but absent from another.
bool Measurement::still(const Window& window) noexcept {
  bool all = true;
  for (std::size_t pair = 0; pair < pairs_.size(); ++pair) {
    if (pair > 0 && !evaluate(pair, window)) continue;  // a channel that is silent holds up nobody
    look_for_transient(pair, window);
    for (std::size_t tone = 0; tone < dwell_->tones.size(); ++tone) {
      all = all && result(pair, tone).still;
    }
  }
  return all;
}

bool Measurement::target_met(std::size_t pair) const noexcept {
  if (!judgement_.has_target() || (pair > 0 && judgement_.target_of_first)) return true;
  for (std::size_t tone = 0; tone < dwell_->tones.size(); ++tone) {
    const Result& each = result(pair, tone);
    if (each.variance.dof == 0.0) return false;
    const Interval half = interval(each, std::max(1.0, each.variance.expected));
    if (judgement_.target_db > 0.0 && !(half.gain_db <= judgement_.target_db)) return false;
    if (judgement_.target_deg > 0.0 && !(half.phase_deg <= judgement_.target_deg)) return false;
  }
  return true;
}

void Measurement::judge() noexcept {
  if (modal_live_ || samples_ < next_look_) return;
  Window window = current_window();
  const auto samples_of = [&] {
    return regression_.samples_at(window.last) - regression_.samples_at(window.first);
  };
  if (samples_of() < dwell_->blocks * dwell_->block_samples) return;
  if (!whole_blocks_ && !estimator_.is_sinusoidal(regression_, window, applied_row,
                                                  dwell_->tones.size(), dwell_->harmonic_bins())) {
    whole_blocks_ = true;
    window = current_window();
  }
  const std::uint64_t length = samples_of();
  const std::uint64_t least_blocks = whole_blocks_ && !window.settled ? 2 : 1;
  if (length < std::max<std::uint64_t>(least_blocks, dwell_->blocks) * dwell_->block_samples) {
    return;
  }
  const auto waited =
      static_cast<double>(regression_.samples_at(window.first) - regression_.samples_at(0));
  if (static_cast<double>(length) < window_per_wait * waited) return;
  if (!evaluate(0, window)) return;
  next_look_ = samples_ + length / looks_per_length;
  if (judgement_.settling != Settling::fixed && !still(window)) {
    first_ += (window.last - window.first + 3) / 4;
    return;
  }
  const bool settling_is_fixed = judgement_.settling == Settling::fixed;
  for (std::size_t pair = 0; pair < pairs_.size(); ++pair) {
    if (pair > 0 && settling_is_fixed && !evaluate(pair, window)) continue;
    if (!target_met(pair)) return;
  }
  conclude();
  done_ = true;
}

void Measurement::conclude() noexcept {
  if (dwell_ == nullptr || done_) return;
  if (modal_live_ && !waiting_ && solver_->idle()) {
    modal_->conclude(*store_);
    if (modal_->result(0).known) {
      take_modal();
      return;
    }
  }
  const Window window = current_window();
  if (window.last == window.first) return;
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

Point Measurement::point(std::size_t pair, std::size_t tone) const noexcept {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const Result& each = result(pair, tone);
  const Estimate& estimate = each.estimate;
  Point point;
  point.tone = static_cast<std::uint16_t>(tone);
  point.pair = static_cast<std::uint16_t>(pair);
  point.input = static_cast<std::uint16_t>(applied_channel + pairs_[pair].input);
  point.output = static_cast<std::uint16_t>(applied_channel + pairs_[pair].output);
  point.frequency_hz = omega_[tone] / (2.0 * std::numbers::pi);
  if (!each.known) {
    point.response = {nan, nan};
    point.covariance = {nan, nan, nan};
    point.gain_interval_db = nan;
    point.phase_interval_deg = nan;
    return point;
  }
  const Interval half = interval(each);
  const double gain = std::abs(estimate.response);
  point.settled_by = by_model_                                ? SettledBy::model
                     : judgement_.settling == Settling::fixed ? SettledBy::wait
                                                              : SettledBy::detection;
  point.response = estimate.response;
  point.covariance = each.variance.covariance;
  point.dof = each.variance.dof;
  point.gain_interval_db = half.gain_db;
  point.phase_interval_deg = half.phase_deg;
  point.input_amplitude = std::abs(estimate.input);
  point.output_amplitude = std::abs(estimate.output);
  point.snr_db =
      20.0 * std::log10(point.output_amplitude / std::numbers::sqrt2 / estimate.residual_rms);
  point.distortion = estimate.distortion;
  point.drift_per_s =
      estimate.drift_per_block / static_cast<double>(dwell_->block_samples) * rate_hz_;
  point.samples = estimate.samples;
  point.lost = estimate.lost;
  const double loud = estimate.burst - 1.0;
  const double samples_per_cluster = estimate.samples / (0.5 * estimate.scatter_dof + 1.0);
  // Below this the residual is the rounding of the running totals (131 dB at 100 kHz), which has no
  // statistics.
  const bool real_noise = estimate.residual_rms > 1e-6 * estimate.rms;
  const bool burst = real_noise && estimate.burst > burst_ratio &&
                     loud > 8.0 * std::sqrt(2.0 / samples_per_cluster);
  const auto mark = [&](PointStatus status, PointReason reason, double value) {
    point.status = status;
    point.reason = reason;
    point.reason_value = value;
  };
  if (point.output_amplitude == 0.0 && estimate.residual_rms == 0.0) {
    mark(PointStatus::low_signal, PointReason::stuck, 0.0);
  } else if (!each.still) {
    mark(PointStatus::unsettled, PointReason::still_moving, db_per_relative * each.left);
  } else if (burst) {
    mark(PointStatus::low_signal, PointReason::noise_burst, estimate.burst);
  } else if (estimate.own_distortion > judgement_.max_distortion) {
    mark(PointStatus::distorted, PointReason::harmonics, estimate.own_distortion);
  } else if (!target_met(pair)) {
    mark(PointStatus::low_signal, PointReason::target_not_reached, half.gain_db);
  } else if (!(gain > 0.0)) {
    mark(PointStatus::low_signal, PointReason::no_response, 0.0);
  }
  return point;
}

}  // namespace sinerig
