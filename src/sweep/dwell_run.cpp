#include "sweep/dwell_run.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <numbers>

#include "sweep/excitation_check.h"

namespace sinerig {

namespace {

// A dwell that gaps keep from finishing is given up at this many times its planned length.
constexpr std::uint64_t max_dwell_stretch = 4;

// The transient of a dwell's beginning is not to be taken for a wrong sign of a read-back.
constexpr std::uint32_t blocks_before_check = 2;

}  // namespace

DwellRun::DwellRun(const SweepPlan& plan, const RunnerSettings& settings, std::size_t sensors,
                   const Excitation& excitation, Guard& guard, RecordSink& sink)
    : rate_hz_{plan.rate_hz},
      settings_{settings},
      excitation_{excitation},
      guard_{guard},
      sink_{sink},
      measurement_{1 + sensors,        plan.most_bins(), plan.most_tones(),
                   settings.responses, plan.judgement,   plan.rate_hz},
      commanded_{plan.most_tones()},
      range_faults_(sensors),
      follows_(settings.readbacks.size()) {}

void DwellRun::CommandedBlock::add(const Excitation& excitation, bool begins) noexcept {
  const double baseline = excitation.baseline();
  if (begins) {
    std::fill(leaked_.begin(), leaked_.end(), std::complex<double>{});
    first_ = baseline;
  }
  const double moved = baseline - first_;
  if (moved == 0.0) return;
  const auto phasors = excitation.phasors();
  for (std::size_t tone = 0; tone < std::min(leaked_.size(), phasors.size()); ++tone) {
    leaked_[tone] += moved * std::complex<double>{phasors[tone].sine, phasors[tone].cosine};
  }
}

void DwellRun::begin(const Dwell& dwell, std::uint32_t index, std::uint32_t attempt, double scale,
                     std::uint64_t tick, const Beginning& beginning) noexcept {
  dwell_ = &dwell;
  index_ = index;
  attempt_ = attempt;
  scale_ = scale;
  measurement_.start(dwell, beginning);
  // A change of amplitude that the plan has not foreseen takes longer than its ramp.
  const std::uint64_t longer =
      std::max(excitation_.ramp_samples(), dwell.ramp_samples) - dwell.ramp_samples;
  settle_left_ = dwell.settle_samples + longer;
  most_ticks_ = max_dwell_stretch * (dwell.max_samples + longer);
  blocks_ = 0;
  given_up_ = false;
  timing_ = {.dwell = index, .first_tick = tick};
  std::fill(range_faults_.begin(), range_faults_.end(), 0);
}

void DwellRun::pass(const Tick& tick, std::uint64_t ticks) noexcept {
  const std::int64_t lateness_ns = tick.lateness.count();
  const auto microseconds =
      static_cast<std::uint64_t>(std::max<std::int64_t>(lateness_ns, 0)) / 1000;
  const auto bin = static_cast<std::size_t>(std::bit_width(microseconds));
  ++timing_.lateness[std::min(bin, DwellTiming::bins - 1)];
  timing_.max_lateness_ns = std::max(timing_.max_lateness_ns, lateness_ns);
  ++timing_.ticks;
  ticks_ += ticks;
  if (ticks > 1) {
    timing_.skipped += ticks - 1;
    sink_.put(Event{.kind = EventKind::gap,
                    .dwell = index_,
                    .tick = tick.index,
                    .value = static_cast<double>(ticks - 1)});
  }
}

// A late or lost command has disturbed the plant: what was gathered is void, wait again. A lost
// sensor sample has not: it leaves the regression.
void DwellRun::measure(std::uint64_t tick, std::span<const Observation> observations,
                       bool disturbed) noexcept {
  if (disturbed && measurement_.done()) {
    // What has been measured stands; a read-back is judged by what follows.
  } else if (disturbed) {
    ++timing_.resettles;
    settle_left_ = std::max(settle_left_, dwell_->settle_samples);
    measurement_.disturb();
  } else if (settle_left_ > 0 || !excitation_.on_course()) {
    settle_left_ -= std::min<std::uint64_t>(settle_left_, 1);
  } else {
    measurement_.add(excitation_.phasors(), observations);
    if (blocks_ < blocks_before_check) commanded_.add(excitation_, measurement_.block_begins());
    if (measurement_.block_ended()) {
      put_block(tick, observations.size());
      if (blocks_ <= blocks_before_check) check_applied(tick, observations[0].offset_ns);
      if (blocks_ == blocks_before_check) check_readbacks(tick);
    }
  }
  given_up_ = ticks_ >= most_ticks_ && !measurement_.done();
}

bool DwellRun::readbacks_seen() const noexcept {
  return blocks_ >= blocks_before_check ||
         std::find(follows_.begin(), follows_.end(), false) == follows_.end();
}

void DwellRun::put_block(std::uint64_t tick, std::size_t channels) noexcept {
  const Dwell& dwell = *dwell_;
  for (std::size_t tone = 0; tone < dwell.tones.size(); ++tone) {
    for (std::size_t channel = 0; channel < channels; ++channel) {
      if (!measurement_.block_complete(channel)) continue;
      sink_.put(Block{.dwell = index_,
                      .attempt = attempt_,
                      .block = blocks_,
                      .tone = static_cast<std::uint16_t>(tone),
                      .channel = static_cast<std::uint16_t>(applied_channel + channel),
                      .first_tick = tick + 1 - dwell.block_samples,
                      .coefficients = measurement_.block_coefficients(channel, tone)});
    }
  }
  ++blocks_;
}

void DwellRun::refuse(const ExcitationVerdict& verdict, std::uint32_t sensor,
                      std::uint64_t tick) noexcept {
  constexpr TripCause causes[] = {TripCause::none, TripCause::excitation_missing,
                                  TripCause::excitation_other_frequency,
                                  TripCause::excitation_reversed};
  if (verdict.fault == ExcitationFault::none) return;
  guard_.trip(causes[static_cast<std::size_t>(verdict.fault)], sensor, verdict.value, verdict.limit,
              tick);
}

std::complex<double> DwellRun::commanded(std::size_t tone) const noexcept {
  return excitation_.commanded(tone) +
         commanded_.leaked(tone, static_cast<double>(dwell_->block_samples));
}

void DwellRun::check_applied(std::uint64_t tick, std::int64_t offset_ns) noexcept {
  if (!measurement_.block_complete(0)) return;
  for (std::size_t tone = 0; tone < dwell_->tones.size(); ++tone) {
    // What a bus reports a tick later was applied at the time that it says.
    const double angle_rad = 2.0e-9 * std::numbers::pi *
                             dwell_->tone_hz(dwell_->tones[tone], rate_hz_) *
                             static_cast<double>(offset_ns);
    refuse(sinerig::check_applied(
               measurement_.block_coefficients(0, tone).phasor() * std::polar(1.0, -angle_rad),
               commanded(tone), settings_.min_excitation),
           no_sensor, tick);
  }
}

// Once it has followed, a read-back may lag as it will: what is behind a drive turns at high
// frequencies. But it has to go on showing the tones.
void DwellRun::check_readbacks(std::uint64_t tick) noexcept {
  for (std::size_t i = 0; i < settings_.readbacks.size(); ++i) {
    const std::size_t sensor = settings_.readbacks[i];
    const std::optional<ChannelContent> found = measurement_.block_content(1 + sensor);
    if (!found) continue;
    const ExcitationVerdict verdict =
        check_readback(*found, excitation_.commanded(0), !follows_[i]);
    refuse(verdict, static_cast<std::uint32_t>(sensor), tick);
    follows_[i] = follows_[i] || verdict.fault == ExcitationFault::none;
  }
}

void DwellRun::put_lessons() noexcept {
  for (std::size_t pair = 0; pair < measurement_.pairs().size(); ++pair) {
    for (std::size_t tone = 0; tone < dwell_->tones.size(); ++tone) {
      std::optional<Lesson> lesson = measurement_.lesson(pair, tone);
      if (!lesson) continue;
      lesson->dwell = index_;
      lesson->attempt = attempt_;
      sink_.put(*lesson);
    }
  }
}

Point DwellRun::point(std::size_t pair, std::size_t tone) const noexcept {
  Point point = measurement_.point(pair, tone);
  point.dwell = index_;
  point.seconds = static_cast<double>(ticks_) / rate_hz_;
  // Only what was applied is in the unit of the command.
  const double excitation = point.input == applied_channel
                                ? point.input_amplitude / (scale_ * dwell_->tones[tone].amplitude)
                                : 1.0;
  const auto sensor = static_cast<std::size_t>(point.output - first_sensor_channel);
  const auto mark = [&](PointStatus status, PointReason reason, double value) {
    point.status = status;
    point.reason = reason;
    point.reason_value = value;
  };
  if (guard_.trip().tripped()) {
    const bool soft = guard_.trip().soft;
    mark(PointStatus::stopped, soft ? PointReason::soft_limit : PointReason::guard_trip,
         soft ? scale_ : 0.0);
  } else if (given_up_ && timing_.resettles > 0) {
    mark(PointStatus::rt_fault, PointReason::gaps, timing_.resettles);
  } else if (point.reason != PointReason::no_data && !(excitation >= settings_.min_excitation)) {
    mark(PointStatus::low_signal, PointReason::no_excitation, excitation);
  } else if (range_faults_[sensor] > 0) {
    const auto ticks = static_cast<double>(timing_.ticks);
    mark(PointStatus::clipped, PointReason::output_at_range,
         static_cast<double>(range_faults_[sensor]) / ticks);
  } else if (given_up_) {
    mark(PointStatus::rt_fault, PointReason::gaps, point.lost);
  }
  return point;
}

}  // namespace sinerig
