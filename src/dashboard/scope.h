// The last cycles of the dwell under way, thinned out to what a plot can show, and how near each
// channel has come to its limits. Fed with every tick on the recorder's thread.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sweep/guard.h"
#include "sweep/motion_filter.h"
#include "sweep/records.h"

namespace sinerig::dashboard {

// What of a channel the guard compares with a limit, see ChannelLimits.
enum class Quantity : std::uint8_t { value, rate, velocity, acceleration, following };

// The extremes of one guarded quantity in this dwell against its limits.
struct Headroom {
  std::string name;  // "command", "encoder", "encoder rate", "encoder, soft"
  std::string unit;
  std::size_t channel = 0;
  Quantity quantity = Quantity::value;
  double min = -unlimited;  // of the limits; unlimited where there is none
  double max = unlimited;
  double lasting_s = 0.0;  // only what exceeds a limit for so long is a violation
  double low = 0.0;        // of the good samples in this dwell
  double high = 0.0;
  bool seen = false;

  // Part of the way from the middle of the limits to the nearer one that has been used. NaN before
  // the first sample, and where a part would tell nothing: one limit has no middle, and what
  // lasts too short counts for nothing.
  double used() const;
  // Least distance to a limit, below 0 beyond it. NaN before the first sample.
  double left() const;
};

// The rows that these limits give: of the command and of every sensor that has one. What has no
// measure (ages, codes, the loop's lateness, faults of the actuator) gives none.
std::vector<Headroom> headroom_rows(const GuardSettings& limits,
                                    const std::vector<std::string>& names,
                                    const std::vector<std::string>& units);

class Scope {
 public:
  static constexpr std::size_t cycles = 2;
  static constexpr std::size_t most_samples = 240;
  static constexpr std::size_t least_samples = 48;

  Scope(std::size_t channels, const GuardSettings& limits, const std::vector<std::string>& names,
        const std::vector<std::string>& units, double rate_hz);

  // Forgets the dwell before; keeps `cycles` cycles of this frequency from here on.
  void start(double frequency_hz);

  void add(const TickSamples& samples);

  struct Trace {
    double step_s = 0.0;                        // between two samples
    std::vector<std::vector<double>> channels;  // oldest first; 0 command, 1 applied, 2… sensors
  };
  Trace trace() const;
  const std::vector<Headroom>& headroom() const { return headroom_; }

 private:
  // Of one channel, what its limits are compared with: as in Guard.
  struct Channel {
    std::vector<std::size_t> rows;  // of headroom_
    double filter_s = 0.0;
    MotionFilter motion;
    double last = 0.0;  // good sample
    std::uint64_t last_tick = 0;
    std::int32_t last_offset_ns = 0;
    bool seen = false;
  };

  void watch(std::size_t channel, const TickSamples& samples);
  void note(const Channel& channel, Quantity quantity, double value);
  void keep(const TickSamples& samples);

  double rate_hz_;
  std::vector<Headroom> headroom_;
  std::vector<Channel> channels_;
  double applied_ = 0.0;
  bool applied_known_ = false;
  std::uint64_t stride_ = 1;
  std::size_t length_ = least_samples;
  std::vector<std::vector<double>> ring_;
  std::size_t next_ = 0;
};

}  // namespace sinerig::dashboard
