// How long exchanges take.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace sinerig::modbus {

struct Pace {
  std::size_t exchanges = 0;
  std::size_t failed = 0;
  std::int64_t median_ns = 0;
  std::int64_t slow_ns = 0;  // 95 % take less
  std::int64_t worst_ns = 0;
};

// The newest few thousand exchanges.
class PaceRecord {
 public:
  PaceRecord() { durations_.reserve(kept); }

  void add(std::int64_t duration_ns, bool failed) noexcept;
  void clear() noexcept;

  // Failed exchanges count, and their durations.
  Pace pace() const;

 private:
  static constexpr std::size_t kept = 4096;

  std::vector<std::int64_t> durations_;
  std::size_t exchanges_ = 0;
  std::size_t failed_ = 0;
};

}  // namespace sinerig::modbus
