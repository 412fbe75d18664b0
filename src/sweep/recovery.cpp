#include "sweep/recovery.h"

#include <algorithm>

namespace sinerig {
namespace {

// A try may take 0.3 s and more of the wait.
constexpr double between_releases_s = 0.5;

}  // namespace

Recovery::Recovery(const RetrySettings& settings, Clock& clock, RecordSink& sink, Rearm* rearm)
    : settings_{settings},
      clock_{clock},
      sink_{sink},
      rearm_{rearm},
      faults_{settings.faults, settings.faults_in_all},
      soft_{settings.soft, settings.soft_in_all} {}

Recovery::End Recovery::after_fault(const Trip& trip, std::uint32_t dwell,
                                    RunControl& control) noexcept {
  const std::string reason = rearm_->fault_reason(trip);
  if (!reason.empty()) note(EventKind::device_fault, dwell, clock_.now().tick, reason);
  while (faults_.spend()) {
    sink_.put(Event{.kind = EventKind::rearming,
                    .dwell = dwell,
                    .tick = clock_.now().tick,
                    .value = settings_.wait_s});
    if (const End end = wait(dwell, control); end != End::armed) return end;
    const std::string obstacle = rearm_->arm_again();
    if (control.stop_requests.load(std::memory_order_relaxed) > 0) return End::stop_requested;
    if (obstacle.empty()) {
      sink_.put(Event{.kind = EventKind::rearmed, .dwell = dwell, .tick = clock_.now().tick});
      return End::armed;
    }
    note(EventKind::rearm_failed, dwell, clock_.now().tick, obstacle);
  }
  return End::used_up;
}

Recovery::End Recovery::wait(std::uint32_t dwell, RunControl& control) noexcept {
  const std::uint64_t begin = clock_.now().tick;
  const double ticks = settings_.wait_s * clock_.grid().rate_hz();
  control.dwell.store(dwell, std::memory_order_relaxed);
  std::uint64_t now = begin;
  double next_try = 0.0;
  while (static_cast<double>(now - begin) < ticks) {
    if (control.stop_requests.load(std::memory_order_relaxed) > 0) return End::stop_requested;
    if (!sink_.flush()) return End::recorder_stalled;
    if (static_cast<double>(now - begin) >= next_try) {
      rearm_->keep_released();
      next_try += between_releases_s * clock_.grid().rate_hz();
    }
    now = clock_.wait().index;
    control.tick.store(now, std::memory_order_relaxed);
  }
  return End::armed;
}

void Recovery::tell_release(std::uint32_t dwell, std::uint64_t tick) noexcept {
  const std::string missing = rearm_ != nullptr ? rearm_->not_released() : std::string{};
  if (missing.empty()) {
    sink_.put(Event{.kind = EventKind::released, .dwell = dwell, .tick = tick});
  } else {
    note(EventKind::not_released, dwell, tick, missing);
  }
}

void Recovery::note(EventKind kind, std::uint32_t dwell, std::uint64_t tick,
                    const std::string& text) noexcept {
  Note note{.kind = kind, .dwell = dwell, .tick = tick};
  std::copy_n(text.begin(), std::min(text.size(), note.text.size() - 1), note.text.begin());
  sink_.put(note);
}

}  // namespace sinerig
