// The guard sees every sample and has the last word on every command. From a violation to a changed
// command: at most one tick.
#pragma once

#include <cstdint>
#include <vector>

#include "drivers/driver.h"
#include "sweep/motion_filter.h"
#include "sweep/nonblocking.h"
#include "sweep/plan.h"
#include "sweep/trip.h"

namespace sinerig {

// A soft bound ends the dwell, a hard one the sweep.
struct Bound {
  double soft = unlimited;
  double hard = unlimited;

  bool set() const { return soft < unlimited || hard < unlimited; }
};

struct ChannelLimits {
  double min = -unlimited;
  double max = unlimited;
  double rate_per_s = unlimited;  // |change between two samples| / time between them

  double soft_min = -unlimited;
  double soft_max = unlimited;
  // Of the samples' difference quotient behind a low-pass of first order, v, and of that of v
  // behind another one: |v| and |dv/dt|. A sine at ω is seen at 1/√(1 + (ωτ)²) of its velocity,
  // and at 1/(1 + (ωτ)²) of its acceleration.
  Bound velocity{};
  Bound acceleration{};
  double derivative_filter_s = 0.0;  // τ
  // |what was applied − sample|, exceeded for longer than `following_ns`.
  Bound following{};
  std::int64_t following_ns = 0;
  std::vector<double> allowed{};  // any other value is a device's report of a fault; empty: any
  std::int64_t max_age_ns = -1;   // of the newest good sample; 0 = not watched, −1 as the guard's

  bool watched_closely() const;  // has any of the limits below the first three
};

struct GuardSettings {
  double command_min = -unlimited;
  double command_max = unlimited;
  double slew_per_s = unlimited;
  double neutral = 0.0;                // the command that leaves the rig at rest
  std::int64_t max_age_ns = 0;         // of the newest good sample of a channel; 0 = not watched
  std::uint32_t max_write_faults = 2;  // this many faulty writes in a row are a dead actuator
  std::uint64_t stop_ramp_ticks = 0;   // from the last command to neutral; 0 = at once
  std::int64_t max_lateness_ns = INT64_MAX;  // of a tick
  std::vector<ChannelLimits> channels;       // one per sensor, in order
};

class Guard {
 public:
  // `period_s` is the tick. Throws std::invalid_argument for limits that exclude the neutral
  // command or cross each other.
  Guard(GuardSettings settings, double period_s);

  // What may go out at this tick instead of `wanted`: the same while all is well, the ramp to
  // neutral after a trip. `ticks` have passed since the last call.
  double admit(double wanted, std::uint64_t tick, std::uint64_t ticks) noexcept SINERIG_NONBLOCKING;

  // What the actuator answered, and what each sensor read.
  void observe_write(const Sample& applied, std::uint64_t tick) noexcept SINERIG_NONBLOCKING;
  void observe(std::uint32_t channel, const Sample& sample, std::int64_t now_ns,
               std::uint64_t tick) noexcept SINERIG_NONBLOCKING;

  void observe_lateness(std::int64_t lateness_ns, std::uint64_t tick) noexcept SINERIG_NONBLOCKING {
    if (lateness_ns > settings_.max_lateness_ns) trip_late(lateness_ns, tick);
  }

  // Starts the ramp to neutral for a reason from outside; the first cause is the one kept, but a
  // hard one takes the place of a soft one.
  // A ramp already under way is cut short by `at_once`.
  void stop(TripCause cause, std::uint64_t tick, bool at_once = false) noexcept SINERIG_NONBLOCKING;

  // The same with the figure behind it; `channel` is a sensor's index.
  void trip(TripCause cause, std::uint32_t channel, double value, double limit, std::uint64_t tick,
            bool soft = false) noexcept SINERIG_NONBLOCKING;

  const Trip& trip() const noexcept { return trip_; }

  // The ramp has ended: nothing is left but to release.
  bool finished() const noexcept { return trip_.tripped() && ramp_left_ == 0 && changed_; }

  // Begins anew, at neutral, nothing known of any channel.
  void resume() noexcept SINERIG_NONBLOCKING;

 private:
  struct ChannelState {
    double last_value = 0.0;
    std::int64_t last_good_ns = 0;
    bool seen = false;
  };
  // What is known of a channel that is watched closely.
  struct Motion {
    MotionFilter filter;
    std::int64_t soft_error_ns = -1;  // when the following error came to exceed its bound
    std::int64_t hard_error_ns = -1;
  };

  double ramp_down(std::uint64_t ticks) noexcept;
  void trip_late(std::int64_t lateness_ns, std::uint64_t tick) noexcept;
  void watch_closely(std::uint32_t channel, const Sample& sample,
                     std::uint64_t tick) noexcept SINERIG_NONBLOCKING;
  void watch_motion(std::uint32_t channel, const Sample& sample,
                    std::uint64_t tick) noexcept SINERIG_NONBLOCKING;
  void watch_following(std::uint32_t channel, const Sample& sample,
                       std::uint64_t tick) noexcept SINERIG_NONBLOCKING;
  void hold(const Bound& bound, double value, TripCause cause, std::uint32_t channel,
            std::uint64_t tick) noexcept SINERIG_NONBLOCKING;

  GuardSettings settings_;
  double max_step_;
  std::vector<ChannelState> channels_;
  std::vector<bool> closely_;  // per channel
  std::vector<Motion> motions_;
  Trip trip_;
  double last_command_;
  double applied_ = 0.0;
  bool applied_known_ = false;
  bool changed_ = false;  // a command after the trip has gone out
  std::uint64_t ramp_left_ = 0;
  std::uint32_t write_faults_ = 0;
  std::int64_t watch_from_ns_ = -1;
};

}  // namespace sinerig
