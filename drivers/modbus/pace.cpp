#include "drivers/modbus/pace.h"

#include <algorithm>

namespace sinerig::modbus {

void PaceRecord::add(std::int64_t duration_ns, bool failed) noexcept {
  if (failed) ++failed_;
  if (durations_.size() < kept)
    durations_.push_back(duration_ns);
  else
    durations_[exchanges_ % kept] = duration_ns;
  ++exchanges_;
}

void PaceRecord::clear() noexcept {
  durations_.clear();
  exchanges_ = 0;
  failed_ = 0;
}

Pace PaceRecord::pace() const {
  Pace pace{.exchanges = exchanges_, .failed = failed_};
  if (durations_.empty()) return pace;
  std::vector<std::int64_t> sorted = durations_;
  std::ranges::sort(sorted);
  const std::size_t last = sorted.size() - 1;
  pace.median_ns = sorted[last / 2];
  pace.slow_ns = sorted[last * 95 / 100];
  pace.worst_ns = sorted[last];
  return pace;
}

}  // namespace sinerig::modbus
