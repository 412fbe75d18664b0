#include "sweep/outbox.h"

#include <algorithm>
#include <bit>
#include <chrono>
#include <thread>

namespace sinerig {

namespace {

constexpr std::chrono::milliseconds before_next_try{1};

}  // namespace

RecordQueue::RecordQueue(std::size_t capacity)
    : slots_(std::bit_ceil(std::max<std::size_t>(capacity, 2))), mask_{slots_.size() - 1} {}

bool RecordQueue::try_push(const Record& record) noexcept {
  const std::uint64_t head = head_.load(std::memory_order_relaxed);
  if (head - tail_.load(std::memory_order_acquire) > mask_) return false;
  slots_[head & mask_] = record;
  head_.store(head + 1, std::memory_order_release);
  return true;
}

bool RecordQueue::try_pop(Record& record) noexcept {
  const std::uint64_t tail = tail_.load(std::memory_order_relaxed);
  if (tail == head_.load(std::memory_order_acquire)) return false;
  record = slots_[tail & mask_];
  tail_.store(tail + 1, std::memory_order_release);
  return true;
}

std::size_t RecordQueue::free() const noexcept {
  const std::uint64_t used =
      head_.load(std::memory_order_relaxed) - tail_.load(std::memory_order_acquire);
  return slots_.size() - static_cast<std::size_t>(used);
}

Outbox::Outbox(std::size_t capacity, std::size_t backlog, WhenFull when_full,
               std::uint64_t most_lag_ticks)
    : queue_{capacity},
      reserve_{queue_.free() / 4},
      when_full_{when_full},
      backlog_(std::max<std::size_t>(backlog, 1)),
      most_lag_ticks_{most_lag_ticks} {}

void Outbox::push_waiting(const Record& record) noexcept {
  while (!queue_.try_push(record) && !abandoned()) std::this_thread::yield();
}

void Outbox::hand_over_dwell() noexcept {
  handed_at_[handed_ % most_outstanding].store(ticks_.load(std::memory_order_relaxed),
                                               std::memory_order_relaxed);
  ++handed_;
}

void Outbox::put(const Record& record) noexcept {
  const bool ends_dwell = std::holds_alternative<DwellTiming>(record);
  if (ends_dwell) hand_over_dwell();
  if (when_full_ == WhenFull::wait) {
    push_waiting(record);
    if (!ends_dwell) return;
    for (std::uint64_t durable = durable_.load(); durable < handed_; durable = durable_.load()) {
      durable_.wait(durable);
    }
    return;
  }
  empty_backlog();
  if (backlog_count_ == 0 && queue_.try_push(record)) return;
  // flush() has told the loop to stop long before the last slot is taken.
  if (backlog_count_ == backlog_.size()) return;
  backlog_[(backlog_first_ + backlog_count_) % backlog_.size()] = record;
  ++backlog_count_;
}

void Outbox::put_sample(const TickSamples& samples) noexcept {
  if (when_full_ == WhenFull::wait) {
    push_waiting(samples);
  } else if (queue_.free() <= reserve_ || !queue_.try_push(samples)) {
    ++dropped_samples_;
  }
}

void Outbox::empty_backlog() noexcept {
  while (backlog_count_ > 0 && queue_.try_push(backlog_[backlog_first_])) {
    backlog_first_ = (backlog_first_ + 1) % backlog_.size();
    --backlog_count_;
  }
}

bool Outbox::disk_keeps_up() const noexcept {
  const std::uint64_t durable = durable_.load(std::memory_order_acquire);
  if (durable >= handed_) return true;
  // Of more than there is room to remember, the oldest remembered.
  const std::uint64_t oldest = std::max(durable, handed_ - std::min(handed_, most_outstanding));
  const std::uint64_t handed_at =
      handed_at_[oldest % most_outstanding].load(std::memory_order_relaxed);
  return ticks_.load(std::memory_order_relaxed) - handed_at <= most_lag_ticks_;
}

bool Outbox::flush() noexcept {
  ticks_.store(ticks_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  empty_backlog();
  overdue_ = overdue_ || !disk_keeps_up();
  return backlog_count_ <= backlog_.size() / 2 && !overdue_ && !abandoned();
}

// Asleep between tries: whoever closes may still have a priority above the consumer's.
void Outbox::close() noexcept {
  for (empty_backlog(); backlog_count_ > 0 && !abandoned(); empty_backlog()) {
    std::this_thread::sleep_for(before_next_try);
  }
  closed_.store(true, std::memory_order_release);
}

std::uint64_t Outbox::acknowledge() noexcept {
  const std::uint64_t dwell = durable_.load();
  if (abandoned()) return 0;
  const std::uint64_t handed_at =
      handed_at_[dwell % most_outstanding].load(std::memory_order_relaxed);
  const std::uint64_t lag = ticks_.load(std::memory_order_relaxed) - handed_at;
  durable_.store(dwell + 1);
  durable_.notify_all();
  return lag;
}

void Outbox::abandon() noexcept {
  abandoned_.store(true, std::memory_order_release);
  durable_.store(std::numeric_limits<std::uint64_t>::max());
  durable_.notify_all();
}

}  // namespace sinerig
