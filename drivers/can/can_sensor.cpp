#include "drivers/can/can_sensor.h"

#include <cmath>

namespace sinerig::can {

CanSensor::CanSensor(Bus& bus, const FeedbackSettings& settings)
    : bus_(bus), settings_(settings), slot_(0), unwrapper_(settings.signal.wrap_modulus) {
  check(settings_.signal, settings_.pattern.minimum_length);
  slot_ = bus_.listen(settings_.pattern, settings_.checksum);
  bus_.plan_to_send(settings_.polls.size());
}

Sample CanSensor::read() noexcept {
  for (const Frame& question : settings_.polls) bus_.send(question);
  bus_.poll();
  const Slot& slot = bus_.slot(slot_);
  const bool spoiled = slot.spoiled != seen_spoiled_;
  seen_spoiled_ = slot.spoiled;

  if (slot.count == seen_count_) {
    const std::int64_t now_ns = monotonic_ns();
    if (silent_since_ns_ == 0) silent_since_ns_ = now_ns;
    last_.fault = Fault::stale;
    if (settings_.timeout_ns > 0 && now_ns - silent_since_ns_ > settings_.timeout_ns)
      last_.fault = Fault::timeout;
    if (spoiled || bus_.state() != BusState::up) last_.fault = Fault::bus;
    return last_;
  }

  take_in(slot);
  return last_;
}

void CanSensor::catch_up() noexcept {
  const Slot& slot = bus_.slot(slot_);
  seen_spoiled_ = slot.spoiled;
  if (slot.count != seen_count_) take_in(slot);  // its angle goes on from there
  silent_since_ns_ = 0;
  last_.fault = Fault::stale;
}

void CanSensor::take_in(const Slot& slot) noexcept {
  seen_count_ = slot.count;
  silent_since_ns_ = slot.time_ns;
  const auto payload = slot.frame.payload();
  const double value = decode(payload, settings_.signal);
  const bool invalid =
      !std::isfinite(value) ||
      (settings_.invalid_raw && extract_raw(payload, settings_.signal) == *settings_.invalid_raw);
  last_.time_ns = slot.time_ns;
  last_.fault = invalid ? Fault::range : Fault::none;
  if (!invalid) last_.value = unwrapper_.apply(value);
}

}  // namespace sinerig::can
