#include "sweep/deputy.h"

#include <chrono>
#include <utility>

namespace sinerig {

namespace {

// Being asked must not cost the loop a system call, so the deputy looks for work by itself.
constexpr std::chrono::microseconds look_interval{200};

}  // namespace

Deputy::Deputy(std::function<void()> job, Where where) : job_{std::move(job)} {
  if (where == Where::own_thread) {
    thread_ = std::jthread{[this](const std::stop_token& stop) {
      work(stop);
    }};
  }
}

Deputy::~Deputy() = default;

void Deputy::ask() noexcept {
  if (thread_.joinable()) {
    asked_.store(true, std::memory_order_release);
  } else {
    const SystemCall time_stands_still;  // the job may allocate, as it may on its own thread
    job_();
  }
}

void Deputy::work(const std::stop_token& stop) noexcept {
  while (!stop.stop_requested()) {
    if (asked_.load(std::memory_order_acquire)) {
      job_();
      asked_.store(false, std::memory_order_release);
    } else {
      std::this_thread::sleep_for(look_interval);
    }
  }
}

}  // namespace sinerig
