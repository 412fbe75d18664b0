#include "sim/simulated_rig.h"

#include <algorithm>
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

  // The command becomes the input of the plant, or of the loop around it. A controller reads before
  // it writes: its plant has no direct feedthrough, so sampling first changes nothing.
  // Returns the time, ns.
  std::int64_t apply(double command) noexcept {
    const Instant present = clock_.now();
    const PlantTime now = plant_time(present, period_ns_);
    const std::int64_t now_ns = clock_.time_ns(present);
    if (!controller_) {
      plant_.apply(command, now);
      refresh(now, now_ns);
      return now_ns;
    }
    refresh(now, now_ns);
    plant_.sample(now, outputs_);
    plant_.apply(controller_->step(command, outputs_[feedback_]).plant_input, now);
    for (Channel& channel : channels_) {
      if (channel.signal != Signal::plant_output) {
        channel.history[channel.newest].value = loop_signal(channel.signal);
      }
    }
    return now_ns;
  }

  // The sample of a sensor's output; a second read without a command in between samples again.
  Sample take(std::size_t sensor) noexcept;

  double period_s() const noexcept { return period_ns_ * 1e-9; }

 private:
  struct Channel {
    Signal signal;
    std::size_t output;
    double delay_ticks;
    double jitter_ticks;
    std::vector<Sample> history;  // ring: the sample of each of the last whole ticks of delay
    std::size_t newest = 0;
    bool taken = true;
    PlantTime instant;
    std::mt19937_64 jitter;

    std::size_t oldest() const noexcept { return newest + 1 == history.size() ? 0 : newest + 1; }
  };

  void refresh(PlantTime now, std::int64_t now_ns) noexcept;
  double loop_signal(Signal signal) const noexcept;
  void sample(Channel& channel, std::int64_t now_ns, PlantTime now) noexcept;

  const Clock& clock_;
  double period_ns_;
  Plant plant_;
  std::optional<Controller> controller_;
  std::size_t feedback_;
  std::vector<double> outputs_;
  std::vector<Channel> channels_;
  std::vector<std::size_t> order_;  // channels by sampling instant
};

SimulatedRig::Core::Core(const SimulatedRigSettings& settings, const Clock& clock)
    : clock_{clock},
      period_ns_{clock.grid().period_s() * 1e9},
      plant_{settings.system, clock.grid().period_s(), settings.friction},
      feedback_{settings.feedback},
      outputs_(plant_.outputs()) {
  if (settings.controller) {
    if (settings.system.d(static_cast<Eigen::Index>(settings.feedback)) != 0.0) {
      throw std::invalid_argument(
          "a controller needs a plant without direct feedthrough to the output that it controls");
    }
    controller_.emplace(*settings.controller, clock.grid().period_s());
  }
  for (std::size_t i = 0; i < settings.sensors.size(); ++i) {
    const SimulatedSensor& sensor = settings.sensors[i];
    const double delay_ticks = sensor.imperfections.delay_s / period_s();
    const double whole = std::floor(delay_ticks + 1e-9);
    // The scatter must stay within the tick that it belongs to.
    const double jitter_ticks = sensor.imperfections.jitter_s / period_s();
    if (jitter_ticks >= 1.0) {
      throw std::invalid_argument("the jitter of a simulated sensor must be below one period");
    }
    channels_.push_back({.signal = sensor.signal,
                         .output = sensor.output,
                         .delay_ticks = std::max(0.0, delay_ticks - whole),
                         .jitter_ticks = jitter_ticks,
                         .history = std::vector<Sample>(static_cast<std::size_t>(whole) + 1),
                         .instant = {},
                         .jitter = std::mt19937_64{stream_seed(settings.seed, 100 + i)}});
    order_.push_back(i);
  }
  plant_.apply(settings.neutral, PlantTime{});
}

// Sensors are sampled in the order of their instants, so that the plant only ever moves forward.
void SimulatedRig::Core::refresh(PlantTime now, std::int64_t now_ns) noexcept {
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
  for (const std::size_t i : order_) sample(channels_[i], now_ns, now);
}

void SimulatedRig::Core::sample(Channel& channel, std::int64_t now_ns, PlantTime now) noexcept {
  plant_.sample(channel.instant, outputs_);
  const double back_ns = (now - channel.instant) * period_ns_;
  channel.newest = channel.oldest();
  channel.history[channel.newest] = {.value = outputs_[channel.output],
                                     .time_ns = now_ns - std::llround(back_ns)};
  channel.taken = false;
}

double SimulatedRig::Core::loop_signal(Signal signal) const noexcept {
  const Controller::Signals& signals = controller_->signals();
  if (signal == Signal::error) return signals.error;
  return signal == Signal::control ? signals.control : signals.plant_input;
}

Sample SimulatedRig::Core::take(std::size_t sensor) noexcept {
  Channel& channel = channels_[sensor];
  if (channel.taken) {
    const Instant present = clock_.now();
    refresh(plant_time(present, period_ns_), clock_.time_ns(present));
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
