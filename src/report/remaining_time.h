// How long a run still takes, from what its finished dwells took against the least they could.
#pragma once

#include <cstdint>

#include "sweep/plan.h"

namespace sinerig::report {

class RemainingTime {
 public:
  explicit RemainingTime(const SweepPlan& plan) : plan_{plan} {}

  // Where the loop is: dwell and tick, both never falling.
  void update(std::uint32_t dwell, std::uint64_t tick);

  double elapsed_s() const;    // bench time
  double remaining_s() const;  // bench time, likely; the least before a dwell has finished
  double done() const;         // 0 to 1, by time
  double dwell_s() const;      // in the dwell under way

 private:
  SweepPlan plan_;
  std::uint32_t dwell_ = 0;
  std::uint64_t tick_ = 0;
  std::uint64_t dwell_tick_ = 0;    // at which the dwell under way was first seen
  std::uint64_t least_so_far_ = 0;  // samples that the finished dwells take at least
};

}  // namespace sinerig::report
