#include "sim/simulated_rig.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace sinerig::sim {

namespace {

PlantTime plant_time(Instant instant, double period_ns) noexcept {
  if (instant.offset_ns == 0) return {.tick = instant.tick, .fraction = 0.0};
  const double fraction = static_cast<double>(instant.offset_ns) / period_ns;
  return PlantTime{.tick = instant.tick, .fraction = 0.0}.plus(fraction);
}

}  // namespace

// The plant and the samples of the present instant, shared by the actuator and the sensors.
class SimulatedRig::Core {
 public:
  Core(const SimulatedRigSettings& settings, const Clock& clock);

  // The command becomes the input of the plant, or of the loop around it: a controller reads before
  // it writes. What is sampled before now sees the input before, the rest the new one. Returns the
  // time, ns.
  std::int64_t apply(double command) noexcept {
    const Present present = look();
    const std::size_t sampled = at_the_tick_ ? 0 : sample_before(present);
    const double input = controller_ ? control(command, present.time) : command;
    for (Plant& plant : plants_) plant.apply(input, present.time);
    sample_from(sampled, present);
    return present.time_ns;
  }

  // The sample of a sensor's output; a second read without a command in between samples again.
  Sample take(std::size_t sensor) noexcept;

  double period_s() const noexcept { return period_ns_ * 1e-9; }

 private:
  struct Present {
    PlantTime time;
    std::int64_t time_ns;
  };
  struct Channel {
    Signal signal;
    std::size_t output;
    std::size_t plant;
    double delay_ticks;
    double jitter_ticks;
    std::vector<Sample> history;  // ring: the sample of each of the last whole ticks of delay
    std::size_t newest = 0;
    bool taken = true;
    PlantTime instant;
    std::mt19937_64 jitter;

    std::size_t oldest() const noexcept { return newest + 1 == history.size() ? 0 : newest + 1; }
  };
  struct LoopSignals {
    PlantTime since;
    Controller::Signals signals;
  };

  Present look() const noexcept {
    const Instant instant = clock_.now();
    return {.time = plant_time(instant, period_ns_), .time_ns = clock_.time_ns(instant)};
  }
  std::size_t sample_before(const Present& present) noexcept;
  void sample_from(std::size_t first, const Present& present) noexcept;
  void draw_instants(PlantTime now) noexcept;
  double control(double command, PlantTime now) noexcept;
  double loop_signal(Signal signal, PlantTime instant) const noexcept;
  void sample(Channel& channel, const Present& present) noexcept;
  static void keep(Channel& channel, double value, std::int64_t time_ns) noexcept {
    channel.newest = channel.oldest();
    channel.history[channel.newest] = {.value = value, .time_ns = time_ns};
    channel.taken = false;
  }

  const Clock& clock_;
  double period_ns_;
  // One plant stands where the last of its channels was sampled. A channel that reaches behind the
  // tick before, where others have been since, has a plant to itself: all get the same input.
  std::vector<Plant> plants_;
  std::optional<Controller> controller_;
  // Ring of the loop's latest signals: a channel reaches less than two ticks back, in which a late
  // clock can have up to three commands before the present one.
  std::array<LoopSignals, 4> loop_signals_;
  std::size_t newest_signals_ = 0;
  std::size_t feedback_;
  std::vector<double> outputs_;
  std::vector<Channel> channels_;
  std::vector<std::size_t> order_;  // channels by sampling instant
  bool at_the_tick_ = true;         // no fraction of a delay and no jitter: all are sampled at once
};

SimulatedRig::Core::Core(const SimulatedRigSettings& settings, const Clock& clock)
    : clock_{clock},
      period_ns_{clock.grid().period_s() * 1e9},
      plants_{Plant{settings.system, clock.grid().period_s(), settings.friction}},
      feedback_{settings.feedback},
      outputs_(plants_.front().outputs()) {
  if (settings.controller) {
    if (settings.system.d(static_cast<Eigen::Index>(settings.feedback)) != 0.0) {
      throw std::invalid_argument(
          "a controller needs a plant without direct feedthrough to the output that it controls");
    }
    controller_.emplace(*settings.controller, clock.grid().period_s());
    loop_signals_.fill({.since = {}, .signals = {.plant_input = settings.neutral}});
  }
  for (std::size_t i = 0; i < settings.sensors.size(); ++i) {
    const SimulatedSensor& sensor = settings.sensors[i];
    // Delays that are whole ticks but for the rounding of the division are whole ticks.
    const double delay_ticks = sensor.imperfections.delay_s / period_s();
    const double whole = std::floor(delay_ticks + 1e-9);
    const double fraction = delay_ticks - whole;
    // The scatter must not change the order of the samples.
    const double jitter_ticks = sensor.imperfections.jitter_s / period_s();
    if (jitter_ticks >= 1.0) {
      throw std::invalid_argument("the jitter of a simulated sensor must be below one period");
    }
    channels_.push_back({.signal = sensor.signal,
                         .output = sensor.output,
                         .plant = 0,
                         .delay_ticks = fraction < 1e-9 ? 0.0 : fraction,
                         .jitter_ticks = jitter_ticks,
                         .history = std::vector<Sample>(static_cast<std::size_t>(whole) + 1),
                         .instant = {},
                         .jitter = std::mt19937_64{stream_seed(settings.seed, 100 + i)}});
    if (sensor.signal == Signal::plant_output && fraction + jitter_ticks > 1.0) {
      channels_.back().plant = plants_.size();
      plants_.push_back(plants_.front());
    }
    order_.push_back(i);
    at_the_tick_ = at_the_tick_ && channels_.back().delay_ticks == 0.0 && jitter_ticks == 0.0;
  }
  for (Plant& plant : plants_) plant.apply(settings.neutral, PlantTime{});
}

// What is due before now, while the input is what it was. Returns how many that were.
std::size_t SimulatedRig::Core::sample_before(const Present& present) noexcept {
  draw_instants(present.time);
  std::size_t next = 0;
  for (; next < order_.size() && channels_[order_[next]].instant - present.time < 0.0; ++next) {
    sample(channels_[order_[next]], present);
  }
  return next;
}

void SimulatedRig::Core::sample_from(std::size_t first, const Present& present) noexcept {
  if (!at_the_tick_) {
    for (std::size_t n = first; n < order_.size(); ++n) sample(channels_[order_[n]], present);
    return;
  }
  plants_.front().sample(present.time, outputs_);
  for (Channel& channel : channels_) {
    keep(channel,
         channel.signal == Signal::plant_output ? outputs_[channel.output]
                                                : loop_signal(channel.signal, present.time),
         present.time_ns);
  }
}

// Sensors are sampled in the order of their instants, so that the plant only ever moves forward.
void SimulatedRig::Core::draw_instants(PlantTime now) noexcept {
  for (Channel& channel : channels_) {
    double back = channel.delay_ticks;
    if (channel.jitter_ticks > 0.0) {
      back +=
          channel.jitter_ticks * std::uniform_real_distribution<double>{0.0, 1.0}(channel.jitter);
    }
    const double since_start = now - PlantTime{};
    channel.instant = now.plus(-std::min(back, since_start));
  }
  const auto earlier = [&](std::size_t a, std::size_t b) {
    return channels_[a].instant - channels_[b].instant < 0.0;
  };
  if (!std::is_sorted(order_.begin(), order_.end(), earlier)) {
    std::sort(order_.begin(), order_.end(), earlier);
  }
}

// The plant's input from now on. The feedback has no direct feedthrough: it is the same before and
// after the input changes.
double SimulatedRig::Core::control(double command, PlantTime now) noexcept {
  plants_.front().sample(now, outputs_);
  newest_signals_ = (newest_signals_ + 1) % loop_signals_.size();
  loop_signals_[newest_signals_] = {.since = now,
                                    .signals = controller_->step(command, outputs_[feedback_])};
  return controller_->signals().plant_input;
}

double SimulatedRig::Core::loop_signal(Signal signal, PlantTime instant) const noexcept {
  std::size_t held = newest_signals_;
  for (std::size_t n = 1; n < loop_signals_.size() && instant - loop_signals_[held].since < 0.0;
       ++n) {
    held = held == 0 ? loop_signals_.size() - 1 : held - 1;
  }
  const Controller::Signals& signals = loop_signals_[held].signals;
  if (signal == Signal::error) return signals.error;
  return signal == Signal::control ? signals.control : signals.plant_input;
}

void SimulatedRig::Core::sample(Channel& channel, const Present& present) noexcept {
  double value = 0.0;
  if (channel.signal == Signal::plant_output) {
    Plant& plant = plants_[channel.plant];
    // After a late command, or read again, another channel may have been further: never a value of
    // another instant than its stamp.
    if (channel.instant - plant.time() < 0.0) channel.instant = plant.time();
    plant.sample(channel.instant, outputs_);
    value = outputs_[channel.output];
  } else {
    value = loop_signal(channel.signal, channel.instant);
  }
  const double back_ns = (present.time - channel.instant) * period_ns_;
  keep(channel, value, present.time_ns - std::llround(back_ns));
}

Sample SimulatedRig::Core::take(std::size_t sensor) noexcept {
  Channel& channel = channels_[sensor];
  if (channel.taken) {
    const Present present = look();
    sample_from(at_the_tick_ ? 0 : sample_before(present), present);
  }
  channel.taken = true;
  return channel.history[channel.oldest()];
}

class SimulatedRig::Drive final : public Actuator {
 public:
  Drive(Core& core, const ActuatorImperfections& settings, double neutral, std::uint64_t seed)
      : core_{core},
        settings_{settings},
        neutral_{neutral},
        position_{neutral},
        held_{neutral},
        max_step_{settings.slew_per_s * core.period_s()},
        dropout_{seed} {}
  ~Drive() override { Drive::release(); }

  Sample write(double command) noexcept override {
    const bool lost =
        settings_.dropout_fraction > 0.0 &&
        std::uniform_real_distribution<double>{}(dropout_) < settings_.dropout_fraction;
    if (!lost) {
      const double slewed =
          std::clamp(settings_.gain * command, position_ - max_step_, position_ + max_step_);
      position_ = std::clamp(slewed, settings_.min, settings_.max);
      held_ = std::clamp(quantise(position_, settings_.quantum), settings_.min, settings_.max);
    }
    const std::int64_t now_ns = core_.apply(held_);
    return {.value = held_, .time_ns = now_ns, .fault = lost ? Fault::bus : Fault::none};
  }

  void release() noexcept override {
    position_ = neutral_;
    held_ = neutral_;
    core_.apply(held_);
  }

 private:
  Core& core_;
  ActuatorImperfections settings_;
  double neutral_;
  double position_;  // within clamp and slew, before the quantiser: slow moves add up to a step
  double held_;
  double max_step_;
  std::mt19937_64 dropout_;
};

class SimulatedRig::Probe final : public Sensor {
 public:
  Probe(Core& core, std::size_t index, const SensorImperfections& settings, std::uint64_t seed)
      : core_{core},
        index_{index},
        settings_{settings},
        generator_{stream_seed(seed, 1)},
        pink_{settings.pink_noise_rms, stream_seed(seed, 2)},
        backlash_{settings.backlash} {}

  Sample read() noexcept override {
    Sample sample = core_.take(index_);
    const double time_s = static_cast<double>(sample.time_ns - first_ns(sample)) * 1e-9;
    if (chance(settings_.lost_fraction)) {
      return {.value = last_.value, .time_ns = last_.time_ns, .fault = Fault::stale};
    }
    sample.value = distort(sample.value, time_s);
    if (sample.value < settings_.min || sample.value > settings_.max) {
      sample.value = std::clamp(sample.value, settings_.min, settings_.max);
      sample.fault = Fault::range;
    }
    if (time_s >= settings_.stuck_at_s) sample.value = last_.value;
    const Sample before = last_;
    last_ = sample;
    return chance(settings_.late_fraction) && before.time_ns != 0 ? before : sample;
  }

 private:
  std::int64_t first_ns(const Sample& sample) noexcept {
    if (first_ns_ < 0) first_ns_ = sample.time_ns;
    return first_ns_;
  }

  bool chance(double fraction) noexcept {
    return fraction > 0.0 && std::uniform_real_distribution<double>{}(generator_) < fraction;
  }

  double distort(double value, double time_s) noexcept {
    if (settings_.backlash > 0.0) value = backlash_.pass(value);
    value += settings_.bias + settings_.drift_per_s * time_s;
    if (settings_.noise_rms > 0.0) value += settings_.noise_rms * normal_(generator_);
    if (settings_.pink_noise_rms > 0.0) value += pink_.next();
    return quantise(value, settings_.quantum);
  }

  Core& core_;
  std::size_t index_;
  SensorImperfections settings_;
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
  PinkNoise pink_;
  Backlash backlash_;
  Sample last_;
  std::int64_t first_ns_ = -1;
};

SimulatedRig::SimulatedRig(const SimulatedRigSettings& settings, const Clock& clock)
    : core_{std::make_unique<Core>(settings, clock)},
      drive_{std::make_unique<Drive>(*core_, settings.actuator, settings.neutral,
                                     stream_seed(settings.seed, 0))} {
  for (std::size_t i = 0; i < settings.sensors.size(); ++i) {
    probes_.push_back(std::make_unique<Probe>(*core_, i, settings.sensors[i].imperfections,
                                              stream_seed(settings.seed, 1 + i)));
  }
}

SimulatedRig::~SimulatedRig() = default;

Actuator& SimulatedRig::actuator() noexcept {
  return *drive_;
}
Sensor& SimulatedRig::sensor(std::size_t index) noexcept {
  return *probes_[index];
}

}  // namespace sinerig::sim
