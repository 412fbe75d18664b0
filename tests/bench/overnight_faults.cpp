#include "overnight_faults.h"

#include <cmath>
#include <random>

namespace sinerig::bench {

namespace {

// Longer than any recovery here: a lost connection, the waits, a drive that refuses twice.
constexpr double apart_s = 60.0;

constexpr double room_temperature = 30.0;

}  // namespace

const char* to_string(Ill ill) {
  constexpr const char* names[ill_kinds] = {"drive trips",  "error code",  "connection lost",
                                            "sensor dead",  "bump (soft)", "hot (soft)",
                                            "command lost", "loop sleeps"};
  return names[static_cast<std::size_t>(ill)];
}

std::vector<Planted> plant_night(double hours, double rate_hz, double every_s, std::uint64_t seed) {
  std::mt19937_64 random{seed};
  std::exponential_distribution<double> pause{1.0 / std::max(1.0, every_s - apart_s)};
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>{low, high}(random);
  };
  const auto ticks = [&](double seconds) {
    return static_cast<std::uint64_t>(std::llround(seconds * rate_hz));
  };
  std::vector<Planted> ills;
  for (double at_s = apart_s; at_s < hours * 3600.0; at_s += apart_s + pause(random)) {
    Planted planted{.ill = static_cast<Ill>(random() % ill_kinds), .tick = ticks(at_s)};
    switch (planted.ill) {
      case Ill::drive_trips: planted.failing_arms = static_cast<std::uint32_t>(random() % 3); break;
      case Ill::connection_lost: planted.ticks = ticks(between(0.5, 20.0)); break;
      case Ill::sensor_dead: planted.ticks = ticks(between(0.5, 8.0)); break;
      case Ill::bump: planted.ticks = ticks(between(0.005, 0.1)); break;
      case Ill::hot: planted.ticks = ticks(between(0.1, 0.9)); break;
      case Ill::gap: planted.ticks = 1 + random() % ticks(0.9); break;
      case Ill::error_code:
      case Ill::command_lost: break;
    }
    ills.push_back(planted);
  }
  return ills;
}

class Night::Probe final : public Sensor {
 public:
  Probe(Night& night, std::size_t index) : night_{night}, index_{index} {}
  Sample read() noexcept override { return night_.read(index_); }

 private:
  Night& night_;
  std::size_t index_;
};

Tick NightClock::wait() noexcept {
  next_ += night_.skip_before(next_);
  night_.meet(next_);
  return {.index = next_++, .lateness = {}};
}

Night::Night(std::vector<Planted> ills, double rate_hz)
    : ills_{std::move(ills)}, clock_{rate_hz, *this} {
  for (std::size_t i = 0; i < sensor_count; ++i)
    probes_.push_back(std::make_unique<Probe>(*this, i));
}

Night::~Night() = default;

void Night::stand_before(Actuator& actuator, Sensor& position, Sensor& velocity) {
  actuator_ = &actuator;
  plant_sensors_ = {&position, &velocity};
}

Sensor& Night::sensor(std::size_t index) {
  return *probes_[index];
}

std::uint64_t Night::skip_before(std::uint64_t tick) noexcept {
  if (next_ == ills_.size() || ills_[next_].ill != Ill::gap || ills_[next_].tick > tick) return 0;
  ills_[next_].tick = tick + ills_[next_].ticks;
  return ills_[next_].ticks;
}

void Night::meet(std::uint64_t tick) noexcept {
  if (next_ == ills_.size() || ills_[next_].tick > tick) return;
  Planted& ill = ills_[next_++];
  ill.met = true;
  ill.tick = tick;
  const std::uint64_t until = tick + ill.ticks;
  switch (ill.ill) {
    case Ill::drive_trips:
      tripped_ = true;
      failing_arms_ = ill.failing_arms;
      break;
    case Ill::error_code: code_ = 0x2310; break;
    case Ill::connection_lost: lost_until_ = until; break;
    case Ill::sensor_dead: dead_until_ = until; break;
    case Ill::bump: bumped_until_ = until; break;
    case Ill::hot: hot_until_ = until; break;
    case Ill::command_lost: lose_command_ = true; break;
    case Ill::gap: break;
  }
}

Sample Night::own(double value) const noexcept {
  return {.value = value, .time_ns = clock_.time_ns(clock_.now()), .fault = Fault::none};
}

Sample Night::write(double command) noexcept {
  Sample applied = actuator_->write(command);
  if (tripped_) applied.fault = Fault::device;
  if (now() < lost_until_ || lose_command_) applied.fault = Fault::bus;
  lose_command_ = false;
  if (applied.fault != Fault::none) diary_.faulty_writes.push_back(now());
  return applied;
}

Sample Night::read(std::size_t sensor) noexcept {
  Sample sample = sensor == code_sensor          ? own(code_)
                  : sensor == temperature_sensor ? own(now() < hot_until_ ? 85.0 : room_temperature)
                                                 : plant_sensors_[sensor]->read();
  if (sensor == position_sensor && now() < bumped_until_) sample.value += 0.8;
  const bool dead = sensor == position_sensor && now() < dead_until_;
  if (now() < lost_until_ || dead) {
    sample = last_[sensor];
    sample.fault = Fault::timeout;
  } else if (sample.fault == Fault::none) {
    last_[sensor] = sample;
  }
  const bool faulty = sample.fault != Fault::none;
  if (faulty && !faulty_[sensor]) diary_.sensor_faults.push_back({now(), sensor});
  faulty_[sensor] = faulty;
  return sample;
}

std::string Night::fault_reason(const Trip& /*trip*/) const {
  if (now() < lost_until_) return "the connection is lost";
  if (code_ != 0.0) return "the drive shows an error code";
  return tripped_ ? "the drive has tripped" : "";
}

std::string Night::arm_again() {
  ++diary_.arms;
  if (now() < lost_until_) {
    ++diary_.failed_arms;
    return "the drive does not answer";
  }
  if (tripped_ && failing_arms_ > 0) {
    --failing_arms_;
    ++diary_.failed_arms;
    return "the drive refuses to be armed";
  }
  tripped_ = false;
  code_ = 0.0;
  return "";
}

}  // namespace sinerig::bench
