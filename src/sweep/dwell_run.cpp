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

// The power of the command at most, as a multiple of its tones', for a read-back to be judged.
constexpr double most_slow = 1.2;

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
      range_faults_(sensors) {}

void DwellRun::CommandedBlock::add(const Excitation& excitation, bool begins) noexcept {
  const double baseline = excitation.baseline();
  if (begins) {
    std::fill(leaked_.begin(), leaked_.end(), std::complex<double>{});
    sum_ = square_ = 0.0;
    first_ = baseline;
  }
  const double command = excitation.command() - first_;
  sum_ += command;
  square_ += command * command;
  const double moved = baseline - first_;
  if (moved == 0.0) return;
  const auto phasors = excitation.phasors();
  for (std::size_t tone = 0; tone < std::min(leaked_.size(), phasors.size()); ++tone) {
    leaked_[tone] += moved * std::complex<double>{phasors[tone].sine, phasors[tone].cosine};
  }
}

void DwellRun::begin(const Dwell& dwell, std::uint32_t index, std::uint32_t attempt, double scale,
                     std::uint64_t tick, bool by_detection) noexcept {
  dwell_ = &dwell;
  index_ = index;
  attempt_ = attempt;
  scale_ = scale;
  measurement_.start(dwell, by_detection);
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
  if (disturbed) {
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
      if (blocks_ <= blocks_before_check) check_excitation(tick, observations[0].offset_ns);
    }
  }
  given_up_ = ticks_ >= most_ticks_;
}

void DwellRun::put_block(std::uint64_t tick, std::size_t channels) noexcept {
  const Dwell& dwell = *dwell_;
  for (std::size_t tone = 0; tone < dwell.tones.size(); ++tone) {
    for (std::size_t channel = 0; channel < channels; ++channel) {
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

void DwellRun::check_excitation(std::uint64_t tick, std::int64_t applied_offset_ns) noexcept {
  constexpr TripCause causes[] = {TripCause::none, TripCause::excitation_missing,
                                  TripCause::excitation_other_frequency,
                                  TripCause::excitation_reversed};
  const auto refuse = [&](const ExcitationVerdict& verdict, std::uint32_t sensor) {
    if (verdict.fault == ExcitationFault::none) return;
    guard_.trip(causes[static_cast<std::size_t>(verdict.fault)], sensor, verdict.value,
                verdict.limit, tick);
  };
  const Dwell& dwell = *dwell_;
  const std::size_t tones = dwell.tones.size();
  const auto length = static_cast<double>(dwell.block_samples);
  const auto commanded = [&](std::size_t tone) {
    return excitation_.commanded(tone) + commanded_.leaked(tone, length);
  };
  for (std::size_t tone = 0; tone < tones; ++tone) {
    // What a bus reports a tick later was applied at the time that it says.
    const double angle_rad = 2.0e-9 * std::numbers::pi *
                             dwell.tone_hz(dwell.tones[tone], rate_hz_) *
                             static_cast<double>(applied_offset_ns);
    refuse(check_applied(
               measurement_.block_coefficients(0, tone).phasor() * std::polar(1.0, -angle_rad),
               commanded(tone), settings_.min_excitation),
           no_sensor);
  }
  if (blocks_ < blocks_before_check) return;
  double tones_power = 0.0;
  for (std::size_t tone = 0; tone < tones; ++tone) tones_power += 0.5 * std::norm(commanded(tone));
  // The slow part of the command is no foreign signal. Where it is more than a little, a block says
  // nothing of a read-back behind a plant of its own.
  const double all = commanded_.power(length) / tones_power;
  if (all > most_slow) return;
  for (const std::size_t sensor : settings_.readbacks) {
    double tone_power = 0.0;
    for (std::size_t tone = 0; tone < tones; ++tone) {
      tone_power += 0.5 * std::norm(measurement_.block_coefficients(1 + sensor, tone).phasor());
    }
    refuse(check_readback(measurement_.block_coefficients(1 + sensor, 0).phasor(), commanded(0),
                          tone_power * all, measurement_.block_power(1 + sensor)),
           static_cast<std::uint32_t>(sensor));
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
