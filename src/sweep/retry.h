// How often a dwell that was broken off may be repeated.
#pragma once

#include <cstdint>
#include <string>

#include "sweep/nonblocking.h"
#include "sweep/trip.h"

namespace sinerig {

struct RetrySettings {
  // A device's fault: disarm, wait, arm again, repeat the dwell.
  std::uint32_t faults = 0;  // of one dwell; 0: the first fault stops the sweep
  std::uint32_t faults_in_all = 20;
  double wait_s = 5.0;

  // A soft limit: the command to neutral, wait, repeat the dwell at `soft_factor` of its amplitude.
  // A dwell that has used up its tries is left for the next one.
  std::uint32_t soft = 3;  // of one dwell
  std::uint32_t soft_in_all = 50;
  double soft_factor = 0.5;
  double soft_wait_s = 1.0;
};

// So many tries for a dwell, and so many in all.
class RetryBudget {
 public:
  RetryBudget(std::uint32_t per_dwell, std::uint32_t in_all)
      : per_dwell_{per_dwell}, in_all_{in_all} {}

  // Takes one, if there is one left.
  bool spend() noexcept SINERIG_NONBLOCKING {
    if (of_dwell_ == per_dwell_ || spent_ == in_all_) return false;
    ++of_dwell_;
    ++spent_;
    return true;
  }
  void next_dwell() noexcept SINERIG_NONBLOCKING { of_dwell_ = 0; }

  std::uint32_t of_dwell() const noexcept { return of_dwell_; }
  std::uint32_t spent() const noexcept { return spent_; }
  bool all_spent() const noexcept { return spent_ == in_all_; }

 private:
  std::uint32_t per_dwell_;
  std::uint32_t in_all_;
  std::uint32_t of_dwell_ = 0;
  std::uint32_t spent_ = 0;
};

// Brings the devices back after a fault. Called by the loop's thread while it does not loop and the
// actuator is released: may wait and allocate.
class Rearm {
 public:
  virtual ~Rearm() = default;

  // What the device of the channel that has tripped says of it, for people; empty where it has
  // nothing to say.
  virtual std::string fault_reason(const Trip& trip) const = 0;

  // While it is waited: a release that could not be carried out, on a dead bus, is tried again.
  virtual void keep_released() noexcept {}

  // What the actuator has not taken of its last release, for people; empty where it is released.
  virtual std::string not_released() const { return {}; }

  // Empty when all devices are armed; else why not, and nothing is: a stop request, too.
  virtual std::string arm_again() = 0;
};

}  // namespace sinerig
