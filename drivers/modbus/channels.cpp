#include "drivers/modbus/channels.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "drivers/monotonic_time.h"

namespace sinerig::modbus {
namespace {

constexpr std::size_t no_rule = static_cast<std::size_t>(-1);
constexpr std::size_t trial_exchanges = 100;
// Of the 100 that were asked; those withheld while a late answer may come don't count. A line that
// loses 1 % is refused once in 1e8 trials, one that loses 5 % once in 85.
constexpr double largest_failed_part = 0.10;
// Of the rate of set-points, for a frequency. The hold of one between two of them is known, what a
// drive makes of it is not.
constexpr double most_of_the_rate = 0.1;

std::string milliseconds(std::int64_t duration_ns) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g ms", static_cast<double>(duration_ns) * 1e-6);
  return text;
}

}  // namespace

std::string obstacle(const Link& link, const Pace& pace) {
  const LinkSettings& settings = link.settings();
  const std::string where = "[modbus." + settings.connection.name + "] ";
  std::ostringstream text;
  if (pace.exchanges == 0 || static_cast<double>(pace.failed) >
                                 largest_failed_part * static_cast<double>(pace.exchanges)) {
    text << where << pace.failed << " of " << pace.exchanges
         << " exchanges failed: " << link.last_failure();
    return text.str();
  }
  const auto period_ns = static_cast<double>(settings.period_ns);
  const auto timeout_ns = static_cast<double>(settings.response_timeout_ns);
  const auto slow_ns = static_cast<double>(pace.slow_ns);
  const auto silence_ns = static_cast<double>(settings.connection.silence_ns);
  const bool fits_the_period = slow_ns + silence_ns <= longest_timeout * period_ns;
  if (fits_the_period && slow_ns <= timeout_ns) return "";
  text.precision(4);
  text << where << settings.connection.address() << ": an exchange takes "
       << milliseconds(pace.median_ns) << ", one in twenty more than "
       << milliseconds(pace.slow_ns);
  if (silence_ns > 0.0)
    text << ", and " << milliseconds(settings.connection.silence_ns) << " of silence";
  text << "; the loop at " << 1e9 / period_ns << " Hz needs one every "
       << milliseconds(settings.period_ns);
  if (fits_the_period)
    text << " and gives it up after " << milliseconds(settings.response_timeout_ns);
  // At the rate that is advised the usual time-out covers it.
  const double advised_ns =
      std::max(slow_ns / usual_timeout, (slow_ns + silence_ns) / longest_timeout);
  text << ": set [loop] rate_hz to " << std::floor(1e9 / advised_ns) << " at most";
  if (fits_the_period)
    text << ", or response_timeout_s to " << std::ceil(slow_ns * 1e-4) * 1e-5 << " at least";
  return text.str();
}

std::string doubt(const Link& link, const Pace& pace, double highest_hz) {
  const LinkSettings& settings = link.settings();
  const double exchange_ns = static_cast<double>(pace.median_ns + settings.connection.silence_ns);
  const double rate_hz = 1e9 / std::max(static_cast<double>(settings.period_ns), exchange_ns);
  if (pace.exchanges == 0 || highest_hz <= most_of_the_rate * rate_hz * (1.0 + 1e-6)) return "";
  std::ostringstream text;
  text.precision(4);
  text << "[modbus." << settings.connection.name << "] " << rate_hz
       << " exchanges a second, of which the sweep's highest frequency of " << highest_hz
       << " Hz is more than a tenth: above " << most_of_the_rate * rate_hz
       << " Hz a period has fewer than ten set-points, and what a drive adds between two of them "
          "(a filter, interpolation) counts; raise [loop] rate_hz, or lower [sweep] stop_hz";
  return text.str();
}

void require_pace(const Link& link, const Pace& pace) {
  const std::string what = obstacle(link, pace);
  if (!what.empty()) throw std::runtime_error(what);
}

ModbusActuator::ModbusActuator(Link& link, CommandSettings settings)
    : link_{link}, settings_{std::move(settings)}, violated_{no_rule} {
  link_.command(settings_.place);
  for (const HealthRule& rule : settings_.health)
    health_fields_.push_back(link_.watch(rule.place, "[actuator] health, " + rule.name));
  health_.resize(settings_.health.size());
  held_.value = settings_.neutral;
}

ModbusActuator::~ModbusActuator() {
  release();
  if (!started_) return;
  link_.idle([&](Transport& transport) {
    if (transport.connected()) run_all(transport, settings_.shutdown, link_.waiting());
  });
}

// A drive that could not be told to stop is told first: its start-up list does not say so.
void ModbusActuator::start() {
  release();
  started_ = true;
  link_.idle([&](Transport& transport) {
    run(transport, settings_.startup, "start-up", link_.waiting());
  });
}

// Neutral goes out before the drive is armed: one that finds a stale set-point would jump. A drive
// may refuse it until it is armed, and then has none. One that says nothing is not armed: what
// switches it on would wait for it, and be carried out when nobody looks any more.
void ModbusActuator::arm() {
  released_ = false;
  try {
    link_.idle([&](Transport& transport) {
      const Answer answer =
          write_surely(transport, settings_.place, settings_.neutral, link_.settings().writing);
      if (answer.outcome != Outcome::ok && answer.outcome != Outcome::exception)
        throw std::runtime_error("neutral, before it is armed: " + transport.describe(answer));
      run(transport, settings_.arm, "arm", link_.waiting());
    });
    require_pace(link_, link_.try_out(settings_.neutral, trial_exchanges));
  } catch (...) {
    release();
    throw;
  }
  link_.set_commanded(true);
  ages_begin_ = true;
}

// Between arm() and the first tick the sweep file is made: that is no silence of the device.
void ModbusActuator::begin_ages() noexcept {
  ages_begin_ = false;
  confirmed_ns_ = link_.tick_ns();
  for (Sample& reading : health_)
    reading = {.value = 0.0, .time_ns = confirmed_ns_, .fault = Fault::stale};
}

Sample ModbusActuator::write(double command) noexcept {
  released_ = false;
  // A command that is no number must not leave the last one standing: neutral goes out instead.
  const bool a_number = std::isfinite(command);
  link_.tick(
      std::clamp(a_number ? command : settings_.neutral, settings_.minimum, settings_.maximum));
  if (ages_begin_) begin_ages();
  last_fault_ = judge();
  look_after_health();
  if (violated_ != no_rule) last_fault_ = Fault::device;
  if (!a_number) last_fault_ = Fault::range;
  Sample answer = held_;
  answer.fault = last_fault_;
  return answer;
}

Fault ModbusActuator::unknown_for_long() const noexcept {
  const bool long_ago = link_.tick_ns() - confirmed_ns_ > settings_.max_age_ns;
  return long_ago && settings_.max_age_ns > 0 ? Fault::timeout : Fault::stale;
}

Fault ModbusActuator::judge() noexcept {
  if (link_.overrun() && !link_.silent()) return Fault::timeout;  // it has never gone out
  if (!link_.fresh()) return unknown_for_long();
  const Exchange& exchange = link_.newest();
  switch (exchange.fate) {
    case CommandFate::confirmed:
      confirmed_ns_ = link_.tick_ns();
      held_.value = exchange.command;
      held_.time_ns = exchange.command_ns;
      return Fault::none;
    case CommandFate::none:
    case CommandFate::unconfirmed: return unknown_for_long();
    case CommandFate::refused:
    case CommandFate::not_sent: return Fault::bus;
  }
  return Fault::bus;
}

void ModbusActuator::look_after_health() noexcept {
  violated_ = no_rule;
  for (std::size_t n = 0; n < health_.size(); ++n) {
    const Sample& reading = link_.newest().fields[health_fields_[n]];
    if (link_.fresh() && reading.fault == Fault::none) health_[n] = reading;
    const bool unknown =
        settings_.max_age_ns > 0 && link_.tick_ns() - health_[n].time_ns > settings_.max_age_ns;
    const bool bad =
        health_[n].fault == Fault::none &&
        !settings_.health[n].comparison.holds(health_[n].value, settings_.health[n].place.format);
    if (violated_ == no_rule && (bad || unknown)) {
      violated_ = n;
      health_is_old_ = !bad;
    }
  }
}

void ModbusActuator::release() noexcept {
  if (released_) return;
  release_ = link_.release(settings_.neutral, settings_.disarm);
  if (release_.neutral) held_.value = settings_.neutral;
  released_ = release_.neutral && release_.disarmed;
}

std::string ModbusActuator::not_released() const {
  if (released_) return "";
  if (release_.neutral)
    return "the drive has not taken all of its disarm list and may still be on: " +
           link_.settings().connection.address();
  return "the drive has not taken neutral and may still be on: " + link_.describe(release_.answer);
}

std::string ModbusActuator::reason() const {
  if (last_fault_ == Fault::none) return "";
  if (violated_ != no_rule) {
    const HealthRule& rule = settings_.health[violated_];
    std::ostringstream text;
    text << rule.name;
    if (health_is_old_)
      text << " could not be read: " << link_.last_failure();
    else
      text << " is " << health_[violated_].value << ", must be " << rule.comparison.text();
    return text.str();
  }
  const std::string failure = link_.recent_failure();
  if (last_fault_ == Fault::timeout && failure.empty())
    return "the device does not keep up with the loop";
  return failure;
}

ModbusSensor::ModbusSensor(Link& link, const FeedbackSettings& settings, const std::string& label,
                           bool paces)
    : link_{link},
      field_{link.watch(settings.place, label)},
      unwrapper_{settings.wrap_modulus},
      paces_{paces} {}

Sample ModbusSensor::read() noexcept {
  if (paces_ && !link_.commanded()) link_.tick(std::nullopt);
  if (!link_.fresh()) {
    last_.fault = Fault::stale;
    return last_;
  }
  const Sample& reading = link_.newest().fields[field_];
  last_.fault = reading.fault;
  if (reading.fault != Fault::none) return last_;
  if (!std::isfinite(reading.value)) {
    last_.fault = Fault::range;
    return last_;
  }
  last_.value = unwrapper_.apply(reading.value);
  last_.time_ns = reading.time_ns;
  return last_;
}

}  // namespace sinerig::modbus
