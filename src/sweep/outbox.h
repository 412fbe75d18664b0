// The one way out of the loop: a bounded single-producer, single-consumer queue that never makes
// the loop wait. Samples may be dropped and are counted; points, blocks and events never are.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "sweep/nonblocking.h"
#include "sweep/records.h"

namespace sinerig {

// Single producer, single consumer; the capacity is rounded up to a power of two.
class RecordQueue {
 public:
  explicit RecordQueue(std::size_t capacity);

  bool try_push(const Record& record) noexcept SINERIG_NONBLOCKING;
  bool try_pop(Record& record) noexcept;
  std::size_t free() const noexcept SINERIG_NONBLOCKING;  // producer's view

 private:
  std::vector<Record> slots_;
  std::size_t mask_;
  alignas(64) std::atomic<std::uint64_t> head_{0};  // next to write
  alignas(64) std::atomic<std::uint64_t> tail_{0};  // next to read
};

class Outbox final : public RecordSink {
 public:
  enum class WhenFull {
    keep,  // real time: keep what must not be lost, drop samples, never wait
    wait,  // virtual time: let the consumer catch up, and have every dwell on the disk before the
           // next begins
  };

  // `most_lag_ticks`: a finished dwell that is not on the disk after so many ticks ends the run.
  Outbox(std::size_t capacity, std::size_t backlog, WhenFull when_full,
         std::uint64_t most_lag_ticks = std::numeric_limits<std::uint64_t>::max());

  // Producer side, from the loop.
  void put(const Record& record) noexcept SINERIG_NONBLOCKING override;
  void put_sample(const TickSamples& samples) noexcept SINERIG_NONBLOCKING override;
  bool flush() noexcept SINERIG_NONBLOCKING override;

  std::uint64_t dropped_samples() const noexcept { return dropped_samples_; }

  // The disk has been too late with a dwell.
  bool overdue() const noexcept { return overdue_; }

  // Producer side, after the loop: hands over what is left, waiting for the consumer, and ends it.
  void close() noexcept;

  // Consumer side. False when nothing is there now; after closed() and one more false, for good.
  bool try_take(Record& record) noexcept { return queue_.try_pop(record); }
  bool closed() const noexcept { return closed_.load(std::memory_order_acquire); }

  // The oldest dwell that has been handed over is on the disk. Ticks of the loop since it ended;
  // none pass in virtual time.
  std::uint64_t acknowledge() noexcept;

  // The consumer gives up: the loop is told to stop and nobody waits any more.
  void abandon() noexcept;

 private:
  static constexpr std::uint64_t most_outstanding = 64;

  bool abandoned() const noexcept { return abandoned_.load(std::memory_order_acquire); }
  void push_waiting(const Record& record) noexcept;
  void hand_over_dwell() noexcept;
  void empty_backlog() noexcept;
  bool disk_keeps_up() const noexcept;

  RecordQueue queue_;
  std::size_t reserve_;  // slots that samples may not take
  WhenFull when_full_;
  std::vector<Record> backlog_;  // ring
  std::size_t backlog_first_ = 0;
  std::size_t backlog_count_ = 0;
  std::uint64_t dropped_samples_ = 0;

  const std::uint64_t most_lag_ticks_;
  std::atomic<std::uint64_t> ticks_{0};  // seen by flush()
  bool overdue_ = false;
  std::uint64_t handed_ = 0;                                              // dwells
  std::atomic<std::uint64_t> durable_{0};                                 // … of them
  std::array<std::atomic<std::uint64_t>, most_outstanding> handed_at_{};  // tick, by dwell
  std::atomic<bool> closed_{false};
  std::atomic<bool> abandoned_{false};
};

}  // namespace sinerig
