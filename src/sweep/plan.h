// The sweep as data, before it is motion: every dwell with its exact frequency, amplitude and
// length, checked against the limits and the rate.
#pragma once

#include <cstdint>
#include <numbers>
#include <vector>

#include "sweep/plan_refused.h"
#include "sweep/sweep_settings.h"
#include "sweep/tone.h"

namespace sinerig {

inline constexpr std::uint32_t max_parts = 8;  // that a block is cut into

struct Tone {
  std::uint64_t cycles = 0;  // per block
  double amplitude = 0.0;
  double phase_rad = 0.0;
};

// One group of tones held: ramp and wait, then blocks until the judgement is made.
struct Dwell {
  double asked_hz = 0.0;
  std::uint32_t sub_band = 0;       // which of the sub-bands it belongs to, from 0
  std::uint64_t block_samples = 1;  // whole cycles of every tone
  std::uint32_t parts = 1;          // a block is cut into this many, a power of two
  std::vector<Tone> tones;
  std::uint32_t harmonics = 1;       // highest harmonic of the first tone in the regression
  double bias_hz = 0.0;              // oscillation of the baseline, a bin of its own; 0 = none
  std::uint64_t ramp_samples = 0;    // at the start of the wait
  std::uint64_t settle_samples = 0;  // ramp included; waited for before anything is measured
  std::uint32_t blocks = 0;          // measured at least
  std::uint64_t max_samples = 0;     // of the whole dwell, wait included
  // Of the whole dwell at least, where the transient is modelled: that needs no whole blocks. 0:
  // all that min_samples() says.
  std::uint64_t least_samples = 0;

  std::uint64_t min_samples() const {
    return least_samples > 0 ? least_samples : settle_samples + blocks * block_samples;
  }
  double tone_hz(const Tone& tone, double rate_hz) const {
    return rate_hz * static_cast<double>(tone.cycles) / static_cast<double>(block_samples);
  }
  double frequency_hz(double rate_hz) const { return tone_hz(tones.front(), rate_hz); }
  std::size_t harmonic_bins() const { return harmonics - 1; }
  std::size_t bins() const { return tones.size() + harmonic_bins() + (bias_hz > 0.0 ? 1 : 0); }
};

// What the tones are laid on, through all dwells; reached from neutral over a ramp.
struct Baseline {
  double neutral = 0.0;
  double offset = 0.0;     // from neutral
  double amplitude = 0.0;  // of a slow oscillation
  CoherentFrequency oscillation{};
  std::uint64_t ramp_samples = 0;
  double max_step = unlimited;  // of the command per tick

  bool oscillates() const { return amplitude > 0.0; }
  // Largest change per tick of the oscillation.
  double step() const {
    return oscillates()
               ? 2.0 * std::numbers::pi * amplitude * static_cast<double>(oscillation.cycles) /
                     static_cast<double>(oscillation.samples)
               : 0.0;
  }
  // What of the largest step it leaves to others.
  double free_step() const { return std::max(max_step - step(), 0.02 * max_step); }
};

// When a dwell has been measured well enough; the same for all dwells of a sweep.
struct Judgement {
  Settling settling = Settling::detect;
  double target_db = 0.0;  // 0 = none
  double target_deg = 0.0;
  bool target_of_first = false;  // the other responses take what its windows give
  double check_fraction = 0.0;   // of the modelled dwells: detected as well
  double max_distortion = 0.1;  // more than this part of the tone in harmonics is a distorted point

  bool has_target() const { return target_db > 0.0 || target_deg > 0.0; }
  // The tighter of the targets as a part of the response; a thousandth where there is none.
  double relative_target() const;
};

// What may be measured after the first pass, where the response between two points is not known.
// The candidates divide every gap evenly; all are checked against the limits before anything moves.
struct Refinement {
  std::vector<Dwell> candidates;
  std::uint32_t most_points = 0;
  double tolerance_db = 0.5;

  std::uint64_t max_samples() const;  // were all points added that may be
};

// What is played before the first dwell, on the baseline; see make_probe.
struct Probe {
  std::vector<double> command;      // per tick
  std::uint64_t quiet_samples = 0;  // of them at rest before the waveform begins
  double low_hz = 0.0;
  double high_hz = 0.0;
  double max_step = 0.0;  // of the command per tick
};

struct SweepPlan {
  double rate_hz = 0.0;
  Baseline baseline{};
  Level level{};
  Probe probe{};
  std::vector<Dwell> dwells;
  Refinement refinement{};
  Judgement judgement{};

  std::uint64_t min_samples() const;
  std::uint64_t max_samples() const;  // with all that refinement may add
  double min_seconds() const { return static_cast<double>(min_samples()) / rate_hz; }
  double max_seconds() const { return static_cast<double>(max_samples()) / rate_hz; }

  // Of any dwell, those that refinement may add included.
  std::size_t most_tones() const;
  std::size_t most_bins() const;
};

// Snaps, merges duplicates, sizes every dwell and checks it against the limits.
// Throws PlanRefused before anything moves.
SweepPlan plan_sweep(const SweepSettings& sweep, const MotionLimits& limits, double rate_hz);

}  // namespace sinerig
