// The first pass of a sweep that models transients: a short chirp through the band that is to be
// measured, with the amplitudes that the dwells will have, from which the modes are found.
#pragma once

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "sweep/deputy.h"
#include "sweep/known_modes.h"
#include "sweep/nonblocking.h"
#include "sweep/plan.h"
#include "sweep/regression.h"

namespace sinerig {

// The waveform, laid on the baseline: rest, then an exponential chirp from the lowest to the
// highest frequency, ending where it crosses zero; scaled down where the limits ask for that. Empty
// where the sweep wants none.
Probe make_probe(const SweepSettings& sweep, const MotionLimits& limits, double rate_hz);

// Plays its part while the loop runs: takes the record, has the modes looked for, holds on until
// they are found.
class Prober {
 public:
  // `outputs`: channels of the regression, one per response. Without a finder, or a waveform, it
  // has nothing to do; nor has it at the start of a sweep that knows its modes.
  Prober(const Probe& probe, const std::vector<std::size_t>& outputs, double rate_hz,
         ModeFinder* finder, bool at_start, Deputy::Where where);

  // The dwells have to wait.
  bool running() const noexcept { return stage_ != Stage::done; }

  // One tick. A disturbance (the command was late or lost) voids the record: it is made once more,
  // a few times.
  void add(std::span<const Observation> observations, bool disturbed) noexcept SINERIG_NONBLOCKING;

  // The waveform begins with this tick.
  bool begins() noexcept { return std::exchange(begins_, false); }

  // Nothing has to be found: what is being looked for is waited for, and forgotten.
  void skip() noexcept SINERIG_NONBLOCKING;

  // The command has been at rest in between: plays from the beginning, where it still plays.
  void restart() noexcept SINERIG_NONBLOCKING;

  // The modes have to be found once more.
  void again() noexcept SINERIG_NONBLOCKING;

  // After it has run, not while it runs: nothing where it had nothing to do, or nothing was found.
  const KnownModes* found() const noexcept { return known_ ? &found_ : nullptr; }

 private:
  enum class Stage { playing, searching, done };

  void search() noexcept;
  void hear() noexcept;

  const Probe& probe_;
  double period_s_;
  std::vector<std::size_t> outputs_;
  ModeFinder* finder_;
  Stage stage_;
  std::size_t count_ = 0;
  int attempts_ = 0;
  bool begins_ = true;
  std::vector<double> applied_;
  std::vector<double> values_;  // per output, one after the other
  ProbeRecord record_;
  KnownModes found_;
  bool known_ = false;
  bool forgotten_ = false;  // what is being looked for
  Deputy deputy_;
};

}  // namespace sinerig
