// The last cycles of the dwell under way, thinned out to what a plot can show, and how near each
// channel has come to its limits. Fed with every tick on the recorder's thread.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sweep/guard.h"
#include "sweep/records.h"

namespace sinerig::dashboard {

// The extremes of one guarded quantity in this dwell against its limits.
struct Headroom {
  std::string name;  // "command", "encoder", "encoder rate"
  std::string unit;
  double min = -unlimited;  // of the limits; unlimited where there is none
  double max = unlimited;
  double low = 0.0;  // of the samples in this dwell
  double high = 0.0;
  bool seen = false;

  // Part of the way from the middle of the limits to the nearer one that has been used; of the
  // limit itself where there is only one. NaN before the first sample.
  double used() const;
};

// The rows that these limits give: window and rate of the command and of every sensor that has one.
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
  void note(std::size_t row, double value);

  std::size_t channels_;
  double rate_hz_;
  std::vector<Headroom> headroom_;
  std::vector<std::size_t> window_row_;  // per channel; npos where it has no such limit
  std::vector<std::size_t> rate_row_;
  std::vector<double> last_;
  std::uint64_t last_tick_ = 0;
  bool has_last_ = false;
  std::uint64_t stride_ = 1;
  std::size_t length_ = least_samples;
  std::vector<std::vector<double>> ring_;
  std::size_t next_ = 0;
};

}  // namespace sinerig::dashboard
