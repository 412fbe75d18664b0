#include "sweep/outbox.h"

#include <algorithm>
#include <bit>
#include <thread>

namespace sinerig {

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

Outbox::Outbox(std::size_t capacity, std::size_t backlog, WhenFull when_full)
    : queue_{capacity},
      reserve_{queue_.free() / 4},
      when_full_{when_full},
      backlog_(std::max<std::size_t>(backlog, 1)) {}

void Outbox::push_waiting(const Record& record) noexcept {
  while (!queue_.try_push(record) && !abandoned()) std::this_thread::yield();
}

void Outbox::put(const Record& record) noexcept {
  if (when_full_ == WhenFull::wait) {
    push_waiting(record);
    return;
  }
  flush();
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

bool Outbox::flush() noexcept {
  while (backlog_count_ > 0 && queue_.try_push(backlog_[backlog_first_])) {
    backlog_first_ = (backlog_first_ + 1) % backlog_.size();
    --backlog_count_;
  }
  return backlog_count_ <= backlog_.size() / 2 && !abandoned();
}

void Outbox::close() noexcept {
  while (backlog_count_ > 0 && !abandoned()) {
    flush();
    std::this_thread::yield();
  }
  closed_.store(true, std::memory_order_release);
}

}  // namespace sinerig
