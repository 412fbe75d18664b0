// Does for the loop what is too long for a tick: one job, again and again, on a thread of its own.
// Where time is virtual, nothing is too long, and the job is done at once: such a run is
// deterministic.
#pragma once

#include <atomic>
#include <functional>
#include <thread>

#include "sweep/nonblocking.h"

namespace sinerig {

class Deputy {
 public:
  enum class Where { at_once, own_thread };

  // `job` may not throw.
  Deputy(std::function<void()> job, Where where);
  ~Deputy();
  Deputy(const Deputy&) = delete;
  Deputy& operator=(const Deputy&) = delete;

  // To be asked only while idle.
  void ask() noexcept SINERIG_NONBLOCKING;
  bool idle() const noexcept SINERIG_NONBLOCKING { return !asked_.load(std::memory_order_acquire); }

 private:
  void work(const std::stop_token& stop) noexcept;

  std::function<void()> job_;
  std::atomic<bool> asked_{false};
  std::jthread thread_;  // last: it uses the others
};

}  // namespace sinerig
