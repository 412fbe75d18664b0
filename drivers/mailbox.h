// The newest value from one thread to another: neither ever waits, an unread value is replaced.
//
// One writer, one reader; a third buffer is always free for whoever needs one.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "sweep/nonblocking.h"

namespace sinerig {

template <class Value>
class Mailbox {
 public:
  // Writer. True where the value before was never read.
  bool put(const Value& value) noexcept SINERIG_NONBLOCKING {
    slots_[back_] = value;
    const std::uint8_t old = middle_.exchange(back_ | unread, std::memory_order_acq_rel);
    back_ = old & index_mask;
    return (old & unread) != 0;
  }

  // Reader. False, and `value` untouched, where nothing has been put since the last time.
  bool take(Value& value) noexcept SINERIG_NONBLOCKING {
    if ((middle_.load(std::memory_order_relaxed) & unread) == 0) return false;
    front_ = middle_.exchange(front_, std::memory_order_acq_rel) & index_mask;
    value = slots_[front_];
    return true;
  }

 private:
  static constexpr std::uint8_t unread = 4;
  static constexpr std::uint8_t index_mask = 3;

  std::array<Value, 3> slots_{};
  std::uint8_t back_ = 0;                // writer's
  std::uint8_t front_ = 2;               // reader's
  std::atomic<std::uint8_t> middle_{1};  // index, and whether it is unread
};

}  // namespace sinerig
