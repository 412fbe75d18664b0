// One dwell under way, from its first tick to its points: what is waited for, what a disturbance
// makes void, whether the excitation is there, what the points say of themselves.
#pragma once

#include <algorithm>
#include <complex>
#include <cstdint>
#include <span>
#include <vector>

#include "sweep/clock.h"
#include "sweep/excitation.h"
#include "sweep/excitation_check.h"
#include "sweep/guard.h"
#include "sweep/measurement.h"
#include "sweep/plan.h"
#include "sweep/records.h"
#include "sweep/runner_settings.h"

namespace sinerig {

class DwellRun {
 public:
  // Takes all memory for every dwell of the plan. What is referred to must outlive it.
  DwellRun(const SweepPlan& plan, const RunnerSettings& settings, std::size_t sensors,
           const Excitation& excitation, Guard& guard, RecordSink& sink);

  // `index` in running order, `attempt` at it, `scale` of its planned amplitudes, `tick` its first.
  void begin(const Dwell& dwell, std::uint32_t index, std::uint32_t attempt, double scale,
             std::uint64_t tick, const Beginning& beginning) noexcept SINERIG_NONBLOCKING;
  bool begun() const noexcept { return ticks_ > 0; }

  // `ticks` of the grid have passed since the last call, this one included.
  void pass(const Tick& tick, std::uint64_t ticks) noexcept SINERIG_NONBLOCKING;
  void note_range_fault(std::size_t sensor) noexcept { ++range_faults_[sensor]; }
  void note_usage(const ThreadUsage& usage) noexcept { timing_.usage = usage; }

  // What was applied and read at this tick, the applied signal first; `disturbed`: the command was
  // late or lost.
  void measure(std::uint64_t tick, std::span<const Observation> observations,
               bool disturbed) noexcept SINERIG_NONBLOCKING;

  // Measured as far as it will be; but the first dwells go on until a read-back can be judged.
  bool over() const noexcept {
    return given_up_ || (measurement_.done() && (readbacks_seen() || ticks_ >= most_ticks_));
  }

  // Takes the judgement as it stands, for the end or a stop in the midst of it.
  void conclude() noexcept SINERIG_NONBLOCKING { measurement_.conclude(); }
  // Hands over what the concluded window has taught; takes in what an earlier run's has.
  void put_lessons() noexcept SINERIG_NONBLOCKING;
  void recall(const Lesson& lesson, const Dwell& dwell) noexcept {
    measurement_.recall(lesson, dwell);
  }

  Point point(std::size_t pair, std::size_t tone) const noexcept SINERIG_NONBLOCKING;
  const DwellTiming& timing() const noexcept { return timing_; }

  // The next begins.
  void end() noexcept { ticks_ = 0; }

  // What it knows of the plant, beyond the dwell.
  Measurement& measurement() noexcept { return measurement_; }

  std::size_t responses() const noexcept { return measurement_.pairs().size(); }

 private:
  // The command of the running block, whose slow part (an offset's ramp, a bias motion) leaks into
  // the plain sums.
  class CommandedBlock {
   public:
    explicit CommandedBlock(std::size_t tones) : leaked_(tones) {}
    void add(const Excitation& excitation, bool begins) noexcept;
    // Into the block's coefficients of a tone, b + j a, of `length` samples.
    std::complex<double> leaked(std::size_t tone, double length) const noexcept {
      return 2.0 / length * leaked_[tone];
    }

   private:
    std::vector<std::complex<double>> leaked_;
    double first_ = 0.0;  // baseline at its beginning: what all is counted from
  };

  void put_block(std::uint64_t tick, std::size_t channels) noexcept;
  void check_applied(std::uint64_t tick, std::int64_t offset_ns) noexcept;
  void check_readbacks(std::uint64_t tick) noexcept;
  void refuse(const ExcitationVerdict& verdict, std::uint32_t sensor, std::uint64_t tick) noexcept;
  std::complex<double> commanded(std::size_t tone) const noexcept;
  bool readbacks_seen() const noexcept;

  double rate_hz_;
  const RunnerSettings& settings_;
  const Excitation& excitation_;
  Guard& guard_;
  RecordSink& sink_;
  Measurement measurement_;
  CommandedBlock commanded_;
  std::vector<std::uint64_t> range_faults_;  // per sensor
  std::vector<bool> follows_;                // per read-back: it did once in this sweep

  const Dwell* dwell_ = nullptr;
  std::uint32_t index_ = 0;
  std::uint32_t attempt_ = 0;
  double scale_ = 1.0;
  std::uint32_t blocks_ = 0;
  std::uint64_t ticks_ = 0;  // of the grid since the dwell began; 0: it has to begin
  std::uint64_t settle_left_ = 0;
  std::uint64_t most_ticks_ = 0;  // then it is given up, whatever disturbed it
  bool given_up_ = false;
  DwellTiming timing_;
};

}  // namespace sinerig
