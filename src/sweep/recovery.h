// What happens between a fault and the repeated dwell: wait, arm again, so often and no more.
#pragma once

#include <cstdint>
#include <string>

#include "sweep/clock.h"
#include "sweep/records.h"
#include "sweep/retry.h"
#include "sweep/run_control.h"

namespace sinerig {

class Recovery {
 public:
  enum class End : std::uint8_t { armed, used_up, stop_requested, recorder_stalled };

  // `rearm` may be null: no fault is retried then. What is referred to must outlive it.
  Recovery(const RetrySettings& settings, Clock& clock, RecordSink& sink, Rearm* rearm);

  bool worth_it(const Trip& trip) const noexcept {
    return rearm_ != nullptr && settings_.faults > 0 && trip.device_fault();
  }

  // With the actuator released, outside the loop: each wait goes by the clock, a stop request cuts
  // it short, that of arming, too:
  // then the device may be armed. Notes what it does.
  End after_fault(const Trip& trip, std::uint32_t dwell, RunControl& control) noexcept;

  // After a release: whether it was one, as far as anybody can tell.
  void tell_release(std::uint32_t dwell, std::uint64_t tick) noexcept;

  // Whether a dwell that a soft limit has ended may be tried again.
  bool spend_soft() noexcept SINERIG_NONBLOCKING { return soft_.spend(); }
  bool lowered() const noexcept { return soft_.of_dwell() > 0; }
  bool soft_all_spent() const noexcept { return soft_.all_spent(); }

  void next_dwell() noexcept SINERIG_NONBLOCKING {
    faults_.next_dwell();
    soft_.next_dwell();
  }

  std::uint32_t faults() const noexcept { return faults_.spent(); }
  std::uint32_t soft_trips() const noexcept { return soft_.spent(); }

 private:
  End wait(std::uint32_t dwell, RunControl& control) noexcept;
  void note(EventKind kind, std::uint32_t dwell, std::uint64_t tick,
            const std::string& text) noexcept;

  const RetrySettings& settings_;
  Clock& clock_;
  RecordSink& sink_;
  Rearm* rearm_;
  RetryBudget faults_;
  RetryBudget soft_;
};

}  // namespace sinerig
