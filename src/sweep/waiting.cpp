#include "sweep/waiting.h"

#include <algorithm>
#include <chrono>
#include <thread>

namespace sinerig {

bool Waiting::may_go_on() const noexcept {
  if (control_ == nullptr) return true;
  control_->turns.fetch_add(1, std::memory_order_relaxed);
  if (!stoppable_) return true;
  Veto* const veto = control_->veto.load();
  return control_->stop_requests.load() == 0 && (veto == nullptr || !veto->stands());
}

void Waiting::go_on() const {
  if (!may_go_on()) throw StopRequested{};
}

// Time is counted, not read: no clock makes it endless.
bool Waiting::pause_for(std::int64_t time_ns) const noexcept {
  for (std::int64_t left_ns = time_ns; left_ns > 0; left_ns -= turn_ns) {
    if (!may_go_on()) return false;
    std::this_thread::sleep_for(std::chrono::nanoseconds{std::min(left_ns, turn_ns)});
  }
  return may_go_on();
}

}  // namespace sinerig
