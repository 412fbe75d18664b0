// What the machine has done to a thread: faults and switches that a loop in good order never has.
#pragma once

#include <cstdint>

namespace sinerig {

struct ThreadUsage {
  std::uint64_t minor_faults = 0;          // pages that were in memory but not in the page table
  std::uint64_t major_faults = 0;          // pages that had to be read from a disk
  std::uint64_t involuntary_switches = 0;  // times that something else was given the CPU

  friend constexpr ThreadUsage operator-(const ThreadUsage& now, const ThreadUsage& before) {
    return {.minor_faults = now.minor_faults - before.minor_faults,
            .major_faults = now.major_faults - before.major_faults,
            .involuntary_switches = now.involuntary_switches - before.involuntary_switches};
  }
  friend constexpr ThreadUsage operator+(const ThreadUsage& a, const ThreadUsage& b) {
    return {.minor_faults = a.minor_faults + b.minor_faults,
            .major_faults = a.major_faults + b.major_faults,
            .involuntary_switches = a.involuntary_switches + b.involuntary_switches};
  }
  friend constexpr bool operator==(const ThreadUsage&, const ThreadUsage&) = default;
};

}  // namespace sinerig
