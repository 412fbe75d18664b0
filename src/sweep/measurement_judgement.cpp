// When a dwell is measured well enough: the window under judgement, the transient in it, the
// targets.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "sweep/measurement.h"

namespace sinerig {

namespace {

// The regression's channel of what was applied.
constexpr std::size_t applied_row = 0;

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

// Windows of fewer can't tell harmonics from a ringing transient; what they take in is allowed as
// this multiple of the tolerance of settling.
constexpr std::uint64_t blocks_that_know_harmonics = 2;
constexpr double harmonics_part = 3.0;

// The colour of the noise counts in the judgement of a shift once more degrees of freedom than
// these are behind it; a transient colours the residual too.
constexpr double colour_dof = 10.0;

// Looks are taken when the window has grown by this part: every look is one more chance to be
// fooled.
constexpr std::uint64_t looks_per_length = 32;

// Of a window that is not settled the oldest goes: an eighth of one shorter than this many blocks,
// a quarter of a longer one, which would else be looked at too often. A well-damped plant has
// settled after the first bit of a cycle: g4 took 25.7 s at 80 dB with a quarter, 25.3 s so (best
// fixed rule 23.3 s).
constexpr std::uint64_t short_window = 2;
constexpr std::size_t drop_of_short = 8;
constexpr std::size_t drop_of_long = 4;

// The tolerance of settling where no target sets one.
constexpr double default_settling_tolerance = 1e-3;

}  // namespace

// Checkpoints of the regression in a block.
std::size_t Measurement::parts_per_block() const noexcept {
  return std::max<std::size_t>(1, dwell_->parts / stride_);
}

Window Measurement::current_window() noexcept {
  while (stride_ < regression_.stride()) {
    stride_ *= 2;
    first_ = (first_ + 1) / 2;
  }
  const std::size_t last = regression_.checkpoints() - 1;
  const std::size_t per_block = parts_per_block();
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
    each.no_input = !solved && estimator_.input_silent();
    if (!solved) continue;
    each.estimate = estimates_[tone];
    each.variance = memories_[pair].pooled(each.estimate, omega_[tone] / (2.0 * std::numbers::pi),
                                           pairs_[pair].exact_input);
  }
  return solved;
}

double Measurement::settling_tolerance() const noexcept {
  return judgement_.has_target() ? settling_part_of_target * judgement_.relative_target()
                                 : default_settling_tolerance;
}

// Were the window free of the transient, its late half would stray from the whole only by noise
// (Hausman's test). Nor can the transient have left more than it began with, averaged over the
// radians that it turned against the tone.
void Measurement::look_for_transient(std::size_t pair, const Window& window) noexcept {
  const std::size_t per_block = parts_per_block();
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
    const double leaned_to = pairs_[pair].exact_input ? 1.0 : std::min(1.0, seen);
    const double colour = (dof * seen + colour_dof * leaned_to) / (dof + colour_dof);
    whole.late = strays_[tone];
    whole.late.noise *= std::sqrt(colour);
    TransientBound bound;
    if (tones == 1) {
      bound = transients_[pair].bound(whole.estimate.response, omega_[tone],
                                      std::abs(whole.estimate.input));
      // The whole of the response, where it is not the change from one to the next.
      if (!foreseen_) bound.size = std::max(1.0, bound.size);
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

// Harmonics take in a ringing transient that is near them, and what they take no residual shows.
bool Measurement::may_ring() const noexcept {
  for (std::size_t pair = 0; pair < pairs_.size(); ++pair) {
    const Result& first = result(pair, 0);
    if (first.known && first.estimate.distortion > harmonics_part * settling_tolerance())
      return true;
  }
  return false;
}

// Whether the dwell may end here: by the variance that was expected before the window was seen,
// where that is more. At its end `as_it_is`: what the point says of itself.
bool Measurement::target_met(std::size_t pair, bool as_it_is) const noexcept {
  if (!judgement_.has_target() || (pair > 0 && judgement_.target_of_first)) return true;
  for (std::size_t tone = 0; tone < dwell_->tones.size(); ++tone) {
    const Result& each = result(pair, tone);
    if (each.variance.dof == 0.0) return false;
    const Interval half = interval(each, as_it_is ? 1.0 : std::max(1.0, each.variance.expected));
    if (judgement_.target_db > 0.0 && !(half.gain_db <= judgement_.target_db)) return false;
    if (judgement_.target_deg > 0.0 && !(half.phase_deg <= judgement_.target_deg)) return false;
  }
  return true;
}

void Measurement::judge() noexcept {
  if ((modal_ && modal_->live()) || samples_ < next_look_) return;
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
    const bool short_one = length < short_window * dwell_->block_samples;
    const std::size_t drop = short_one ? drop_of_short : drop_of_long;
    first_ += (window.last - window.first + drop - 1) / drop;
    return;
  }
  const bool settling_is_fixed = judgement_.settling == Settling::fixed;
  if (!settling_is_fixed && length < blocks_that_know_harmonics * dwell_->block_samples &&
      may_ring()) {
    return;
  }
  for (std::size_t pair = 0; pair < pairs_.size(); ++pair) {
    if (pair > 0 && settling_is_fixed && !evaluate(pair, window)) continue;
    if (!target_met(pair)) return;
  }
  conclude();
  done_ = true;
}

}  // namespace sinerig
