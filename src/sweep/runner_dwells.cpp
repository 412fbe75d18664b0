// The order of things: which dwell comes next, at what level, and which is repeated. The tick
// itself is in runner.cpp, the modes of the plant in runner_models.cpp.
#include <algorithm>
#include <optional>
#include <utility>

#include "sweep/runner.h"

namespace sinerig {

// After the actuator has been released: true when everything is armed again and the dwell, or the
// first pass, begins anew.
bool SweepRunner::recover(RunControl& control) noexcept {
  const bool probing = this->probing();
  if ((!under_way() && !probing) || !recovery_.worth_it(guard_.trip())) return false;
  tell_trip(EventKind::tripped);
  recovery_.tell_release(dwell_, last_tick_);
  const Recovery::End end = recovery_.after_fault(guard_.trip(), dwell_, control);
  last_tick_ = clock_.now().tick;
  if (end == Recovery::End::used_up) return false;
  guard_.resume();
  if (end != Recovery::End::armed) {
    actuator_.release();  // the stop may have come as it was armed
    guard_.stop(end == Recovery::End::stop_requested ? TripCause::stop_requested
                                                     : TripCause::recorder_stalled,
                last_tick_);
    guard_.admit(plan_.baseline.neutral, last_tick_, 1);
    return false;
  }
  excitation_.rest();
  from_rest_ = true;
  applied_known_ = false;
  paused_ = false;
  if (probing) {
    prober_.restart();
  } else {
    repeat_dwell();
  }
  return true;
}

// A soft limit has taken the command to neutral: wait, then try the dwell again, lower. False where
// the sweep ends here.
bool SweepRunner::pause(std::uint64_t ticks) noexcept {
  const RetrySettings& retry = settings_.retry;
  if (!std::exchange(paused_, true)) {
    tell_trip(EventKind::limited);
    pause_left_ = static_cast<std::uint64_t>(retry.soft_wait_s * plan_.rate_hz);
  }
  if (!sink_.flush()) guard_.stop(TripCause::recorder_stalled, last_tick_);
  if (pause_left_ > 0) {
    pause_left_ -= std::min(pause_left_, ticks);
    return true;
  }
  paused_ = false;
  if (probing()) {
    if (!probe_lower()) {
      trip_told_ = no_tick;
      return false;
    }
  } else if (recovery_.spend_soft()) {
    scale_ *= retry.soft_factor;
    announce({.kind = EventKind::retried,
              .dwell = dwell_,
              .tick = last_tick_,
              .value = scale_ * next_to_measure().tones.front().amplitude});
    repeat_dwell();
  } else if (recovery_.soft_all_spent() || preflight_) {
    trip_told_ = no_tick;  // as the end of a dwell; now as that of the sweep
    return false;
  } else {
    run_.conclude();
    run_.put_lessons();
    finish_dwell();
    next_dwell();
  }
  guard_.resume();
  excitation_.rest();
  return keep_going();
}

// A soft limit has ended the first pass: once more, more quietly, or without it. False where the
// sweep ends here.
bool SweepRunner::probe_lower() noexcept {
  if (recovery_.spend_soft()) {
    probe_scale_ *= settings_.retry.soft_factor;
    prober_.restart();
    return true;
  }
  if (recovery_.soft_all_spent()) return false;
  prober_.skip();
  if (!prober_.running()) judge_model();
  return true;
}

void SweepRunner::tell_trip(EventKind kind) noexcept {
  const Trip& trip = guard_.trip();
  if (std::exchange(trip_told_, trip.tick) == trip.tick) return;
  const bool of_sensor = trip.of_sensor();
  announce({.kind = kind,
            .channel = static_cast<std::uint16_t>(of_sensor ? first_sensor_channel + trip.channel
                                                            : command_channel),
            .dwell = dwell_,
            .tick = trip.tick,
            .value = trip.value,
            .trip = trip});
}

bool SweepRunner::go_on(const FinishedDwells& finished) {
  auto point = finished.points.begin();
  auto lesson = finished.lessons.begin();
  for (const std::uint32_t candidate : finished.refined) {
    refiner_.use(candidate);
    dwells_.push_back(&plan_.refinement.candidates.at(candidate));
  }
  while (dwell_ < finished.dwells && dwell_ < dwells_.size()) {
    const Dwell& dwell = *dwells_[dwell_];
    for (; lesson != finished.lessons.end() && lesson->dwell <= dwell_; ++lesson) {
      run_.recall(*lesson, dwell);
    }
    for (std::size_t tone = 0; tone < dwell.tones.size(); ++tone) {
      refiner_.add(dwell.tone_hz(dwell.tones[tone], plan_.rate_hz));
      for (; point != finished.points.end() && point->dwell == dwell_ && point->tone == tone;
           ++point) {
        // What a soft limit gave up taught neither the level nor the model.
        const bool given_up = point->status == PointStatus::stopped;
        if (point->pair == 0 && tone == 0 && !given_up) leveller_.accept(*point);
        teach_refiner(*point);
        if (plan_.judgement.settling == Settling::model) review_.set(*point);
        if (point->settled_by == SettledBy::model && !given_up)
          trust_.dwell_ended(dwell_, true, false);
      }
      refiner_.learn();
    }
    ++dwell_;
    ++outcome_.dwells_done;
  }
  if (dwell_ == dwells_.size()) refine();
  for (; lesson != finished.lessons.end() && dwell_ < dwells_.size(); ++lesson) {
    run_.recall(*lesson, *dwells_[dwell_]);
  }
  for (const std::uint32_t dwell : finished.condemned) trust_.condemn(dwell);
  if (dwell_ == dwells_.size()) {
    // What is left is measured by detection.
    prober_.skip();
    remeasuring_ = true;
    next_condemned();
  }
  return !closing();
}

void SweepRunner::begin_dwell(std::uint64_t tick) noexcept {
  const Dwell& dwell = next_to_measure();
  if (!scale_chosen_) {
    // Whatever the points of an earlier part have taught: they may be decades away.
    const Leveller unknowing{plan_.level};
    const Leveller& leveller = preflight_ ? unknowing : leveller_;
    scale_ = leveller.scale(dwell.frequency_hz(plan_.rate_hz), dwell.tones.front().amplitude);
    if (preflight_) scale_ = std::min(scale_, settings_.preflight.level);
  }
  const bool from_rest = excitation_.resting();
  excitation_.start(dwell, scale_);
  if (remeasuring_ && !preflight_ && trust_.condemned(dwell_)) {
    trust_.acquit(dwell_);
    announce({.kind = EventKind::remeasured, .dwell = dwell_, .tick = tick});
  }
  run_.begin(dwell, dwell_, attempt_, scale_, tick,
             {.by_detection = trust_.by_detection(dwell_), .from_rest = from_rest});
  announce({.kind = EventKind::dwell_began, .dwell = dwell_, .tick = tick});
}

// The pre-flight is of the first dwell, whichever the sweep goes on with: what gain and phase are
// to be is known of that one.
const Dwell& SweepRunner::next_to_measure() const noexcept {
  return preflight_ ? *dwells_.front() : *dwells_[dwell_];
}

void SweepRunner::conclude_dwell() noexcept {
  run_.conclude();
  if (!preflight_elsewhere()) run_.put_lessons();
  if (preflight_) {
    if (!pass_preflight()) return;
    preflight_ = false;
    repeat_dwell();
    scale_chosen_ = false;
    return;
  }
  if (try_again()) return;
  check_model();
  // On the disk with the dwell's points: those who go on after a kill have to know.
  if (trust_.doubted()) {
    announce({.kind = EventKind::model_doubted,
              .dwell = dwell_,
              .tick = last_tick_,
              .value = doubt_begins});
  }
  finish_dwell();
  if (!trust_.doubted()) {
    next_dwell();
    return;
  }
  prober_.again();
  if (!prober_.running()) judge_model();  // nobody can find them
}

// Every response is told of; the first that fails trips the guard.
bool SweepRunner::pass_preflight() noexcept {
  bool passed = true;
  for (std::size_t pair = 0; pair < run_.responses(); ++pair) {
    const Point point = run_.point(pair, 0);
    const Trip trip = check_preflight(settings_.preflight, point, pair == 0);
    sink_.put(preflight_of(point, !trip.tripped(), last_tick_));
    if (!trip.tripped()) continue;
    passed = false;
    guard_.trip(trip.cause, trip.channel, trip.value, trip.limit, last_tick_);
  }
  return passed;
}

// The same dwell once more, at scale_.
void SweepRunner::repeat_dwell() noexcept {
  outcome_.skipped_ticks += run_.timing().skipped;
  scale_chosen_ = true;
  ++attempt_;
  run_.end();
}

// The plan, then what refinement adds, then what has to be measured again because the modes that
// its transients were modelled with turned out wrong.
void SweepRunner::next_dwell() noexcept {
  attempt_ = 0;
  scale_chosen_ = false;
  recovery_.next_dwell();
  ++outcome_.dwells_done;
  if (!remeasuring_) {
    ++dwell_;
    if (dwell_ == dwells_.size()) refine();
    remeasuring_ = dwell_ == dwells_.size();
  }
  if (remeasuring_) next_condemned();
}

// One more dwell where the response between two points is not known.
void SweepRunner::refine() noexcept {
  if (dwells_.size() == plan_.dwells.size() + plan_.refinement.most_points) return;
  const double disagreement_db = refiner_.worst_db();
  const std::optional<std::size_t> candidate = refiner_.next();
  if (!candidate) return;
  dwells_.push_back(&plan_.refinement.candidates[*candidate]);  // within what was reserved
  announce({.kind = EventKind::refined,
            .dwell = dwell_,
            .tick = last_tick_,
            .value = disagreement_db,
            .candidate = static_cast<std::uint32_t>(*candidate)});
}

bool SweepRunner::try_again() noexcept {
  const double planned = dwells_[dwell_]->tones.front().amplitude;
  // What a soft limit has brought down is not brought up again.
  if (recovery_.lowered()) {
    leveller_.accept(run_.point(0, 0));
    return false;
  }
  const std::optional<double> scale = leveller_.retry(run_.point(0, 0), scale_, planned);
  if (!scale) return false;
  announce(
      {.kind = EventKind::retried, .dwell = dwell_, .tick = last_tick_, .value = *scale * planned});
  scale_ = *scale;
  repeat_dwell();
  return true;
}

void SweepRunner::teach_refiner(const Point& point) noexcept {
  if (point.status != PointStatus::good) return;
  refiner_.set(point.pair, point.response, point.covariance.mean_variance());
}

void SweepRunner::finish_dwell() noexcept {
  if (!preflight_elsewhere()) put_points();
  account_usage();
  sink_.put(run_.timing());
  outcome_.skipped_ticks += run_.timing().skipped;
  run_.end();
}

void SweepRunner::put_points() noexcept {
  const Dwell& dwell = *dwells_[dwell_];
  for (std::size_t tone = 0; tone < dwell.tones.size(); ++tone) {
    refiner_.add(dwell.tone_hz(dwell.tones[tone], plan_.rate_hz));
    for (std::size_t pair = 0; pair < run_.responses(); ++pair) {
      const Point point = run_.point(pair, tone);
      sink_.put(point);
      teach_refiner(point);
      if (plan_.judgement.settling == Settling::model) review_.set(point);
    }
    refiner_.learn();
  }
}

// The loop's one system call of its own besides the sleep: once a dwell, in its last tick, when the
// command is out and every sensor has been read. It never waits.
void SweepRunner::account_usage() noexcept {
  const std::optional<ThreadUsage> now = clock_.usage();
  if (now && usage_) run_.note_usage(*now - *usage_);
  usage_ = now;
}

}  // namespace sinerig
