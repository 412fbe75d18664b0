// The samples of a dwell since it began, as far as memory goes: what the regression on the modes is
// linearised from again when the poles turn out to be others. The loop writes, the judge reads.
#pragma once

#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "sweep/modal_regression.h"
#include "sweep/nonblocking.h"
#include "sweep/regression.h"
#include "sweep/tone.h"

namespace sinerig {

class ModalStore {
 public:
  ModalStore(std::size_t channels, std::size_t capacity)
      : channels_{channels},
        capacity_{capacity},
        tones_(capacity),
        values_(channels * capacity),
        offsets_(channels * capacity),
        common_(channels),
        seen_(channels) {}

  void clear() noexcept {
    std::fill(seen_.begin(), seen_.end(), false);
    count_.store(0, std::memory_order_release);
  }
  bool full() const noexcept { return count_.load(std::memory_order_relaxed) == capacity_; }
  std::uint64_t count() const noexcept { return count_.load(std::memory_order_acquire); }
  std::size_t channels() const noexcept { return channels_; }
  std::size_t capacity() const noexcept { return capacity_; }

  // One tick; forgotten when there is no room.
  void add(Phasor tone, std::span<const Observation> observations) noexcept SINERIG_NONBLOCKING {
    const std::uint64_t at = count_.load(std::memory_order_relaxed);
    if (at == capacity_) return;
    tones_[at] = tone;
    for (std::size_t channel = 0; channel < channels_; ++channel) {
      const Observation& each = observations[channel];
      const std::size_t place = channel * capacity_ + at;
      values_[place] = each.missing ? std::numeric_limits<double>::quiet_NaN() : each.value;
      if (!each.missing && !seen_[channel]) {
        seen_[channel] = true;
        common_[channel] = each.offset_ns;
      }
      offsets_[place] = static_cast<std::int32_t>(each.offset_ns - common_[channel]);
    }
    count_.store(at + 1, std::memory_order_release);
  }

  // False where the sample is missing.
  bool sample(std::size_t channel, std::uint64_t at, ModalSample& sample) const noexcept {
    const std::size_t place = channel * capacity_ + at;
    sample.tone = tones_[at];
    sample.value = values_[place];
    // Time stamps are whole nanoseconds: within one a sample is on the grid.
    const std::int32_t offset_ns = offsets_[place];
    sample.off_grid_s = offset_ns > 1 || offset_ns < -1 ? 1e-9 * offset_ns : 0.0;
    return !std::isnan(sample.value);
  }

  // Of the first sample of a channel from its tick; all times are referred to it.
  std::int64_t common_offset_ns(std::size_t channel) const noexcept { return common_[channel]; }

 private:
  std::size_t channels_;
  std::size_t capacity_;
  std::vector<Phasor> tones_;
  std::vector<double> values_;
  std::vector<std::int32_t> offsets_;
  std::vector<std::int64_t> common_;
  std::vector<bool> seen_;
  std::atomic<std::uint64_t> count_{0};
};

}  // namespace sinerig
