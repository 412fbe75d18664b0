#include "sweep/runner.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <numbers>
#include <utility>

namespace sinerig {

namespace {

// A dwell that gaps keep from finishing is given up at this many times its planned length.
constexpr std::uint64_t max_dwell_stretch = 4;

// A slow loop that misses a few ticks has not lost its clock, however long that takes.
constexpr std::uint64_t min_lost_ticks = 10;

// The transient of a dwell's beginning is not to be taken for a wrong sign of a read-back.
constexpr std::uint32_t blocks_before_check = 2;

std::size_t most_tones(const SweepPlan& plan) {
  std::size_t most = 1;
  for (const Dwell& dwell : plan.dwells) most = std::max(most, dwell.tones.size());
  return most;
}

std::size_t most_bins(const SweepPlan& plan) {
  std::size_t most = 1;
  for (const Dwell& dwell : plan.dwells) most = std::max(most, dwell.bins());
  for (const Dwell& dwell : plan.refinement.candidates) most = std::max(most, dwell.bins());
  return most;
}

// With room for those that refinement adds.
std::vector<const Dwell*> dwells_of(const SweepPlan& plan) {
  std::vector<const Dwell*> dwells;
  dwells.reserve(plan.dwells.size() + plan.refinement.most_points);
  for (const Dwell& dwell : plan.dwells) dwells.push_back(&dwell);
  return dwells;
}

std::size_t most_points(const SweepPlan& plan) {
  if (plan.refinement.most_points == 0) return 0;
  std::size_t points = plan.refinement.most_points;
  for (const Dwell& dwell : plan.dwells) points += dwell.tones.size();
  return points;
}

Pairs responses_of(const RunnerSettings& settings, std::size_t sensors) {
  if (!settings.responses.empty()) return settings.responses;
  Pairs pairs;
  for (std::size_t i = 0; i < sensors; ++i) pairs.push_back({.input = 0, .output = 1 + i});
  return pairs;
}

std::vector<std::size_t> outputs_of(const Pairs& pairs) {
  std::vector<std::size_t> outputs;
  for (const Pair& pair : pairs) outputs.push_back(pair.output);
  return outputs;
}

class ReleaseOnExit {
 public:
  explicit ReleaseOnExit(Actuator& actuator) : actuator_{actuator} {}
  ~ReleaseOnExit() { actuator_.release(); }
  ReleaseOnExit(const ReleaseOnExit&) = delete;
  ReleaseOnExit& operator=(const ReleaseOnExit&) = delete;

 private:
  Actuator& actuator_;
};

}  // namespace

SweepRunner::SweepRunner(SweepPlan plan, RunnerSettings settings, Clock& clock, Actuator& actuator,
                         std::span<Sensor* const> sensors, Guard& guard, RecordSink& sink)
    : plan_{std::move(plan)},
      settings_{std::move(settings)},
      clock_{clock},
      actuator_{actuator},
      sensors_{sensors.begin(), sensors.end()},
      guard_{guard},
      sink_{sink},
      dwells_{dwells_of(plan_)},
      refiner_{plan_.refinement, plan_.rate_hz, most_points(plan_),
               responses_of(settings_, sensors.size()).size()},
      excitation_{most_tones(plan_), most_bins(plan_), plan_.baseline},
      leveller_{plan_.level},
      measurement_{1 + sensors.size(), most_bins(plan_),
                   most_tones(plan_),  responses_of(settings_, sensors.size()),
                   plan_.judgement,    plan_.rate_hz},
      prober_{plan_.probe,
              outputs_of(measurement_.pairs()),
              plan_.rate_hz,
              settings_.finder,
              !settings_.modes,
              settings_.real_time ? Deputy::Where::own_thread : Deputy::Where::at_once},
      trust_{dwells_.capacity()},
      observations_(1 + sensors.size()),
      sensor_faults_(sensors.size(), Fault::none),
      range_faults_(sensors.size()) {
  if (settings_.real_time) measurement_.solve_elsewhere();
  if (settings_.modes) {
    measurement_.know(settings_.modes->prior, settings_.modes->noise_variance,
                      settings_.modes->noise_dof);
  }
}

RunOutcome SweepRunner::run(RunControl& control) noexcept {
  {
    const ReleaseOnExit release{actuator_};
    announce({.kind = EventKind::started});
    while (step(control)) {
    }
  }
  outcome_.trip = guard_.trip();
  if (outcome_.trip.tripped()) {
    announce({.kind = EventKind::tripped,
              .dwell = dwell_,
              .tick = outcome_.trip.tick,
              .trip = outcome_.trip});
  }
  announce({.kind = EventKind::released, .dwell = dwell_, .tick = last_tick_});
  announce({.kind = EventKind::finished, .dwell = dwell_, .tick = last_tick_});
  return outcome_;
}

bool SweepRunner::step(RunControl& control) noexcept {
  const Tick tick = clock_.wait();
  const bool first = outcome_.ticks == 0;
  const std::uint64_t ticks = first ? 1 : tick.index - last_tick_;

  const bool closing = dwell_ == dwells_.size();
  const bool probing = prober_.running();
  const bool new_dwell = !closing && !probing && dwell_ticks_ == 0;
  if (new_dwell) begin_dwell(first ? 0 : last_tick_ + 1);
  const bool probe_begins = probing && prober_.begins();
  if (probe_begins) excitation_.start(plan_.probe.command, plan_.probe.quiet_samples / 2);
  excitation_.advance(new_dwell || probe_begins ? ticks - 1 : ticks);
  if (!probing) dwell_ticks_ += ticks;
  account(tick, ticks);

  const int stop_requests = control.stop_requests.load(std::memory_order_relaxed);
  if (stop_requests > 0) {
    guard_.stop(TripCause::stop_requested, tick.index, stop_requests > 1);
  }
  const double gap_s = static_cast<double>(ticks - 1) * clock_.grid().period_s();
  if (gap_s > settings_.max_gap_s && ticks > min_lost_ticks) {
    guard_.trip(TripCause::clock_lost, no_sensor, gap_s, settings_.max_gap_s, tick.index);
  }
  command_ = guard_.admit(excitation_.command(), tick.index, ticks);
  exchange(command_, tick);
  control.tick.store(tick.index, std::memory_order_relaxed);
  control.dwell.store(dwell_, std::memory_order_relaxed);

  if (guard_.trip().tripped()) {
    if (!guard_.finished()) return true;
    if (!closing && !probing) {
      measurement_.conclude();
      finish_dwell();
    }
    return false;
  }
  if (closing) return !excitation_.closed();
  const double lateness_s = std::chrono::duration<double>(tick.lateness).count();
  const bool late = lateness_s > settings_.max_lateness * clock_.grid().period_s();
  const bool disturbed = ticks > 1 || late || command_lost_ || command_late_;
  if (probing) {
    probe(disturbed);
  } else {
    measure(tick.index, disturbed);
  }
  if (!sink_.flush()) guard_.stop(TripCause::recorder_stalled, tick.index);
  if (dwell_ < dwells_.size()) return true;
  excitation_.close();
  return !excitation_.closed();
}

// Write, then read, in the same tick; the guard sees all of it.
void SweepRunner::exchange(double command, const Tick& tick) noexcept {
  const std::int64_t tick_ns = clock_.time_ns({.tick = tick.index});
  const auto observe = [&](std::size_t channel, const Sample& sample) {
    observations_[channel] = {.value = sample.value,
                              .offset_ns = sample.time_ns - tick_ns,
                              .missing = sample.fault != Fault::none};
  };
  const Sample applied = actuator_.write(command);
  guard_.observe_write(applied, tick.index);
  observe(0, applied);
  command_lost_ = applied.fault != Fault::none && applied.fault != Fault::stale;
  command_late_ = applied.fault == Fault::none && applied_late(observations_[0].offset_ns);
  if (command_lost_) {
    announce({.kind = EventKind::actuator_fault,
              .fault = applied.fault,
              .dwell = dwell_,
              .tick = tick.index});
  }
  const std::int64_t now_ns = tick_ns + tick.lateness.count();
  for (std::size_t i = 0; i < sensors_.size(); ++i) {
    const Sample sample = sensors_[i]->read();
    guard_.observe(static_cast<std::uint32_t>(i), sample, now_ns, tick.index);
    note_sensor(i, sample, tick.index);
    observe(1 + i, sample);
  }
  if (settings_.record_samples) {
    TickSamples samples{
        .tick = tick.index,
        .dwell = dwell_,
        .channels = static_cast<std::uint32_t>(first_sensor_channel + sensors_.size())};
    samples.values[command_channel] = command;
    for (std::size_t i = 0; i < observations_.size(); ++i) {
      samples.values[applied_channel + i] = observations_[i].value;
    }
    sink_.put_sample(samples);
  }
}

// A bus that takes a fixed time is no disturbance, one that takes longer than the tick before is.
bool SweepRunner::applied_late(std::int64_t offset_ns) noexcept {
  const double change_s = 1e-9 * static_cast<double>(offset_ns - applied_offset_ns_);
  const bool known = std::exchange(applied_known_, true);
  applied_offset_ns_ = offset_ns;
  return known && std::abs(change_s) > settings_.max_lateness * clock_.grid().period_s();
}

void SweepRunner::note_sensor(std::size_t sensor, const Sample& sample,
                              std::uint64_t tick) noexcept {
  if (sample.fault == Fault::range) ++range_faults_[sensor];
  const bool was_good = sensor_faults_[sensor] == Fault::none;
  const bool is_good = sample.fault == Fault::none;
  if (was_good != is_good) {
    announce({.kind = is_good ? EventKind::sensor_recovered : EventKind::sensor_fault,
              .fault = sample.fault,
              .channel = static_cast<std::uint16_t>(first_sensor_channel + sensor),
              .dwell = dwell_,
              .tick = tick});
  }
  sensor_faults_[sensor] = sample.fault;
}

// The first pass, in which the modes are found.
void SweepRunner::probe(bool disturbed) noexcept {
  prober_.add(observations_, disturbed);
  if (prober_.running()) return;
  judge_model();
}

// What the probe found is used from here on.
void SweepRunner::judge_model() noexcept {
  const KnownModes* found = prober_.found();
  const bool doubted = trust_.doubted();
  bool use = found != nullptr;
  if (doubted) {
    const ModelTrust::Judgement judgement = trust_.probed(found, measurement_.modes());
    announce({.kind = EventKind::model_doubted,
              .dwell = dwell_,
              .tick = last_tick_,
              .value = static_cast<double>(judgement)});
    if (judgement == ModelTrust::Judgement::given_up) measurement_.stop_modelling();
    use = judgement == ModelTrust::Judgement::replaced;
  }
  if (use) measurement_.know(found->prior, found->noise_variance, found->noise_dof);
  announce({.kind = EventKind::probed,
            .dwell = dwell_,
            .tick = last_tick_,
            .value = found != nullptr ? static_cast<double>(found->prior.modes) : 0.0});
  if (doubted) next_dwell();
}

// A late or lost command has disturbed the plant: what was gathered is void, wait again. A lost
// sensor sample has not: it leaves the regression.
void SweepRunner::measure(std::uint64_t tick, bool disturbed) noexcept {
  const Dwell& dwell = *dwells_[dwell_];
  if (disturbed) {
    ++timing_.resettles;
    settle_left_ = std::max(settle_left_, dwell.settle_samples);
    measurement_.disturb();
  } else if (settle_left_ > 0) {
    --settle_left_;
  } else {
    measurement_.add(excitation_.phasors(), observations_);
    if (measurement_.block_ended()) {
      put_block(tick);
      if (blocks_ <= blocks_before_check) check_excitation(tick);
    }
  }
  given_up_ = dwell_ticks_ >= max_dwell_stretch * dwell.max_samples;
  if (!measurement_.done() && !given_up_) return;
  measurement_.conclude();
  if (try_again()) return;
  finish_dwell();
  attempt_ = 0;
  ++outcome_.dwells_done;
  trust_.dwell_ended(dwell_, measurement_.modelled(), measurement_.model_refuted());
  if (!trust_.doubted()) {
    next_dwell();
    return;
  }
  prober_.again();
  if (!prober_.running()) judge_model();  // nobody can find them
}

// The plan, then what refinement adds, then what has to be measured again because the modes that
// its transients were modelled with turned out wrong.
void SweepRunner::next_dwell() noexcept {
  if (!remeasuring_) {
    ++dwell_;
    if (dwell_ == dwells_.size()) refine();
    remeasuring_ = dwell_ == dwells_.size();
  }
  if (!remeasuring_) return;
  dwell_ = std::min(trust_.next_condemned(0), static_cast<std::uint32_t>(dwells_.size()));
  if (dwell_ == dwells_.size()) return;
  trust_.acquit(dwell_);
  announce({.kind = EventKind::remeasured, .dwell = dwell_, .tick = last_tick_});
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
  const std::optional<double> scale = leveller_.retry(make_point(0, 0), scale_, planned);
  if (!scale) return false;
  announce(
      {.kind = EventKind::retried, .dwell = dwell_, .tick = last_tick_, .value = *scale * planned});
  scale_ = *scale;
  ++attempt_;
  outcome_.skipped_ticks += timing_.skipped;
  dwell_ticks_ = 0;
  return true;
}

void SweepRunner::begin_dwell(std::uint64_t tick) noexcept {
  const Dwell& dwell = *dwells_[dwell_];
  if (attempt_ == 0) {
    scale_ = leveller_.scale(dwell.frequency_hz(plan_.rate_hz), dwell.tones.front().amplitude);
  }
  excitation_.start(dwell, scale_);
  measurement_.start(dwell);
  settle_left_ = dwell.settle_samples;
  blocks_ = 0;
  given_up_ = false;
  timing_ = {.dwell = dwell_, .first_tick = tick};
  std::fill(range_faults_.begin(), range_faults_.end(), 0);
  announce({.kind = EventKind::dwell_began, .dwell = dwell_, .tick = tick});
}

void SweepRunner::put_block(std::uint64_t tick) noexcept {
  const Dwell& dwell = *dwells_[dwell_];
  for (std::size_t tone = 0; tone < dwell.tones.size(); ++tone) {
    for (std::size_t channel = 0; channel < observations_.size(); ++channel) {
      sink_.put(Block{.dwell = dwell_,
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

void SweepRunner::check_excitation(std::uint64_t tick) noexcept {
  constexpr TripCause causes[] = {TripCause::none, TripCause::excitation_missing,
                                  TripCause::excitation_other_frequency,
                                  TripCause::excitation_reversed};
  const auto refuse = [&](const ExcitationVerdict& verdict, std::uint32_t sensor) {
    if (verdict.fault == ExcitationFault::none) return;
    guard_.trip(causes[static_cast<std::size_t>(verdict.fault)], sensor, verdict.value,
                verdict.limit, tick);
  };
  const Dwell& dwell = *dwells_[dwell_];
  const std::size_t tones = dwell.tones.size();
  for (std::size_t tone = 0; tone < tones; ++tone) {
    // What a bus reports a tick later was applied at the time that it says.
    const double angle_rad = 2.0e-9 * std::numbers::pi *
                             dwell.tone_hz(dwell.tones[tone], plan_.rate_hz) *
                             static_cast<double>(applied_offset_ns_);
    refuse(check_applied(
               measurement_.block_coefficients(0, tone).phasor() * std::polar(1.0, -angle_rad),
               excitation_.commanded(tone), settings_.min_excitation),
           no_sensor);
  }
  if (blocks_ < blocks_before_check) return;
  for (const std::size_t sensor : settings_.readbacks) {
    double tone_power = 0.0;
    for (std::size_t tone = 0; tone < tones; ++tone) {
      tone_power += 0.5 * std::norm(measurement_.block_coefficients(1 + sensor, tone).phasor());
    }
    refuse(
        check_readback(measurement_.block_coefficients(1 + sensor, 0).phasor(),
                       excitation_.commanded(0), tone_power, measurement_.block_power(1 + sensor)),
        static_cast<std::uint32_t>(sensor));
  }
}

void SweepRunner::finish_dwell() noexcept {
  const Dwell& dwell = *dwells_[dwell_];
  for (std::size_t tone = 0; tone < dwell.tones.size(); ++tone) {
    const bool refining = refiner_.add(dwell.tone_hz(dwell.tones[tone], plan_.rate_hz));
    for (std::size_t pair = 0; pair < measurement_.pairs().size(); ++pair) {
      const Point point = make_point(pair, tone);
      sink_.put(point);
      if (refining && point.status == PointStatus::good) {
        refiner_.set(pair, point.response, point.covariance.mean_variance());
      }
    }
    if (refining) refiner_.learn();
  }
  sink_.put(timing_);
  outcome_.skipped_ticks += timing_.skipped;
  dwell_ticks_ = 0;
}

Point SweepRunner::make_point(std::size_t pair, std::size_t tone) const noexcept {
  const Dwell& dwell = *dwells_[dwell_];
  Point point = measurement_.point(pair, tone);
  point.dwell = dwell_;
  point.seconds = static_cast<double>(dwell_ticks_) / plan_.rate_hz;
  // Only what was applied is in the unit of the command.
  const double excitation = point.input == applied_channel
                                ? point.input_amplitude / (scale_ * dwell.tones[tone].amplitude)
                                : 1.0;
  const auto sensor = static_cast<std::size_t>(point.output - first_sensor_channel);
  const auto mark = [&](PointStatus status, PointReason reason, double value) {
    point.status = status;
    point.reason = reason;
    point.reason_value = value;
  };
  if (guard_.trip().tripped()) {
    mark(PointStatus::stopped, PointReason::guard_trip, 0.0);
  } else if (given_up_ && timing_.resettles > 0) {
    mark(PointStatus::rt_fault, PointReason::gaps, timing_.resettles);
  } else if (!(excitation >= settings_.min_excitation)) {
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

void SweepRunner::account(const Tick& tick, std::uint64_t ticks) noexcept {
  const std::int64_t lateness_ns = tick.lateness.count();
  const auto microseconds =
      static_cast<std::uint64_t>(std::max<std::int64_t>(lateness_ns, 0)) / 1000;
  const auto bin = static_cast<std::size_t>(std::bit_width(microseconds));
  ++timing_.lateness[std::min(bin, DwellTiming::bins - 1)];
  timing_.max_lateness_ns = std::max(timing_.max_lateness_ns, lateness_ns);
  ++timing_.ticks;
  ++outcome_.ticks;
  if (ticks > 1) {
    timing_.skipped += ticks - 1;
    announce({.kind = EventKind::gap,
              .dwell = dwell_,
              .tick = tick.index,
              .value = static_cast<double>(ticks - 1)});
  }
  last_tick_ = tick.index;
}

}  // namespace sinerig
