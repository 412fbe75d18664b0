#include "drivers/can/can_actuator.h"

#include <cmath>

namespace sinerig::can {

CanActuator::CanActuator(Bus& bus, CommandSettings settings)
    : bus_(bus),
      settings_(std::move(settings)),
      health_(bus, settings_.health),
      cycles_(settings_.keep_alive.size()),
      frame_(settings_.frame),
      released_frame_(settings_.released.value_or(settings_.frame)) {
  check(frame_);
  check(settings_.signal, frame_.length);
  check(settings_.checksum, frame_.length);
  compose(settings_.neutral);
  check(released_frame_);
  check(settings_.signal, released_frame_.length);
  neutral_ = encode(released_frame_.payload(), settings_.signal, settings_.neutral);
  seal(released_frame_, settings_.checksum);
  for (Sequence* list :
       {&settings_.startup, &settings_.arm, &settings_.disarm, &settings_.shutdown}) {
    for (Step& step : *list) {
      if (!step.neutral) continue;
      step.frame = frame_;
      for (const KeepAlive& kept : settings_.keep_alive)
        if (kept.period_ns == 0) step.company.push_back(kept.frame);
    }
    listen_for(bus_, *list);
  }
  bus_.plan_to_send(1 + settings_.keep_alive.size());
  held_.value = settings_.neutral;
}

CanActuator::~CanActuator() {
  release();
  Patience patience;
  if (started_) run_all(bus_, settings_.shutdown, patience);
}

// A drive that could not be told to stop is told first: its start-up list does not say so.
void CanActuator::start() {
  release();
  started_ = true;
  run(bus_, settings_.startup, "start-up");
}

// Neutral goes out before the drive is armed: one that finds a stale set-point would jump.
void CanActuator::arm() {
  released_ = false;
  bus_.reserve(Bus::Room::lists);
  try {
    Patience patience;
    send_neutral(patience);
    run(bus_, settings_.arm, "arm");
  } catch (...) {
    release();
    throw;
  }
  health_.begin();
  ages_begin_ = true;
  bus_.reserve(Bus::Room::set_points);
}

Sample CanActuator::write(double command) noexcept {
  bus_.poll();
  released_ = false;
  // A command that is no number must not leave the last one standing: neutral goes out instead.
  compose(std::isfinite(command) ? command : settings_.neutral);
  const std::int64_t now_ns = monotonic_ns();
  last_result_ = send_set_point();
  last_state_ = bus_.state();
  if (last_result_ == SendResult::sent) {
    held_.value = encoded_;
    held_.time_ns = now_ns;
  }
  keep_alive(now_ns);
  // Between arm() and the first tick the sweep file is made: that is no silence of the device.
  if (ages_begin_) health_.begin_ages(now_ns);
  ages_begin_ = false;
  violated_ = health_.violated(now_ns);
  Sample answer = held_;
  answer.fault = Fault::none;
  if (!std::isfinite(command)) answer.fault = Fault::range;
  if (last_result_ != SendResult::sent) answer.fault = Fault::bus;
  if (violated_ != nullptr) answer.fault = Fault::device;
  return answer;
}

void CanActuator::compose(double command) noexcept {
  encoded_ = encode(frame_.payload(), settings_.signal, command);
  seal(frame_, settings_.checksum);
}

// A device that did not get its SYNC has not taken the set-point. The SYNC is for others, too: it
// goes out whatever became of the set-point.
SendResult CanActuator::send_set_point() noexcept {
  SendResult result = bus_.send(frame_);
  for (const KeepAlive& kept : settings_.keep_alive) {
    if (kept.period_ns > 0) continue;
    const SendResult sent = bus_.send(kept.frame);
    if (result == SendResult::sent) result = sent;
  }
  return result;
}

void CanActuator::keep_alive(std::int64_t now_ns) noexcept {
  const std::int64_t tick_ns = last_write_ns_ != 0 ? now_ns - last_write_ns_ : 0;
  last_write_ns_ = now_ns;
  for (std::size_t n = 0; n < cycles_.size(); ++n) {
    const KeepAlive& kept = settings_.keep_alive[n];
    if (kept.period_ns > 0 && cycles_[n].is_due(now_ns, kept.period_ns, tick_ns))
      bus_.send(kept.frame);
  }
}

// A device may take a set-point only with the SYNC that comes with every one. The set-points of the
// loop may switch it on, which a release must not, in whatever state it finds the device.
bool CanActuator::send_neutral(Patience& patience) noexcept {
  bool all = send_surely(bus_, released_frame_, patience) == SendResult::sent;
  if (all) held_.value = neutral_;
  for (const KeepAlive& kept : settings_.keep_alive) {
    if (kept.period_ns > 0) continue;
    all = send_surely(bus_, kept.frame, patience) == SendResult::sent && all;
  }
  return all;
}

void CanActuator::release() noexcept {
  if (released_) return;
  bus_.poll();  // what happened to the bus since the last tick
  bus_.reserve(Bus::Room::lists);
  Patience patience;
  neutral_out_ = send_neutral(patience);
  const bool disarmed = run_all(bus_, settings_.disarm, patience) == 0;
  bus_.poll();
  // A bus that died meanwhile has thrown away what waited in its queue.
  neutral_out_ = neutral_out_ && bus_.state() == BusState::up;
  released_ = neutral_out_ && disarmed;
}

std::string CanActuator::not_released() const {
  if (released_) return "";
  const std::string what = neutral_out_ ? "the drive has not taken all of its disarm list"
                                        : "neutral has not gone out to the drive";
  return what + ", which may still be on: " + bus_.interface();
}

std::string CanActuator::reason() const {
  if (violated_ != nullptr) return health_.describe(*violated_);
  switch (last_result_) {
    case SendResult::sent: return "";
    case SendResult::queue_full:
      return bus_.interface() + ": the transmit queue is full, the command was dropped";
    default: return describe(bus_.interface(), last_state_);
  }
}

}  // namespace sinerig::can
