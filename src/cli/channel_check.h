// How a rig's sensors behave while nothing is commanded: rate, age, jitter, losses, and what the
// guard of a sweep would say.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "drivers/driver.h"
#include "sweep/clock.h"
#include "sweep/guard.h"
#include "sweep/run_control.h"

namespace sinerig::cli {

struct ChannelCheck {
  std::uint64_t samples = 0;              // new and good
  std::array<std::uint64_t, 7> faults{};  // by Fault
  std::uint64_t lost = 0;  // samples that the usual distance between two says are missing
  double rate_hz = 0.0;
  double age_median_s = 0.0;  // of a sample when the loop sees it, as the next two
  double age_99_s = 0.0;
  double age_most_s = 0.0;
  double jitter_s = 0.0;  // rms of the distance between two samples about its median, losses aside
  double last_value = 0.0;
  Trip trip{};                   // what would have stopped a sweep
  bool answers_command = false;  // nobody asks while nothing is commanded

  bool silent_as_it_should_be() const { return answers_command && samples == 0; }

  std::uint64_t faulty(Fault fault) const { return faults[static_cast<std::size_t>(fault)]; }
};

struct LoopCheck {
  std::uint64_t ticks = 0;
  std::uint64_t skipped = 0;
  double lateness_99_s = 0.0;
  double lateness_most_s = 0.0;
};

struct RigCheck {
  LoopCheck loop;
  std::vector<ChannelCheck> channels;  // one per sensor, in order
};

// Some of all values, evenly spread over them: each, until there is no more room; then every
// second, every fourth …
class ThinnedSeries {
 public:
  explicit ThinnedSeries(std::size_t room) { values_.reserve(room); }

  void add(std::int64_t value) noexcept;
  const std::vector<std::int64_t>& values() const noexcept { return values_; }
  std::int64_t most() const noexcept { return most_; }  // of all
  std::uint64_t count() const noexcept { return count_; }

 private:
  std::vector<std::int64_t> values_;
  std::uint64_t count_ = 0;
  std::uint64_t every_ = 1;
  std::int64_t most_ = 0;
};

// How often which distance between two samples, to 1 % of it.
class DistanceCounts {
 public:
  DistanceCounts() : counts_(bins) {}

  void add(std::int64_t distance_ns) noexcept;

  // How many samples are missing where `usual_ns` lie between two.
  std::uint64_t missing(double usual_ns) const noexcept;

 private:
  static constexpr std::size_t bins = 4096;  // to 10^17 ns

  std::vector<std::uint64_t> counts_;
};

// What the loop does for a check, and what is made of it afterwards: memory is taken beforehand and
// does not grow, however long it takes.
class ChannelCheckRun {
 public:
  // `guard` has one channel per sensor. `clock` and `sensors` must outlive it.
  ChannelCheckRun(Clock& clock, std::span<Sensor* const> sensors, const GuardSettings& guard);

  // In the loop: reads every sensor at every tick for `seconds` of the clock, or until a stop is
  // requested.
  void read(double seconds, const RunControl& control) noexcept;

  RigCheck evaluate() const;

 private:
  struct Series {
    Series();
    void note(const Sample& sample, std::int64_t now_ns) noexcept;
    ThinnedSeries ages_ns;
    ThinnedSeries distances_ns;
    DistanceCounts counts;
    std::int64_t first_ns = 0;
    std::int64_t last_ns = 0;
  };
  static void evaluate(const Series& series, ChannelCheck& check);

  Clock& clock_;
  std::vector<Sensor*> sensors_;
  std::vector<Guard> guards_;
  std::vector<Series> series_;
  ThinnedSeries lateness_ns_;
  RigCheck check_;
};

}  // namespace sinerig::cli
