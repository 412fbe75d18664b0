// The sweep as data, before it is motion: every dwell with its exact frequency, amplitude and
// length, checked against the limits and the rate.
#pragma once

#include <cstdint>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "sweep/tone.h"

namespace sinerig {

enum class Spacing { logarithmic, linear, list };

// How the end of the transient is known: waited for, or seen; or it is measured along, with the
// plant's modes in the regression, and its end need not be known.
enum class Settling { fixed, detect, model };

struct AmplitudeBreak {
  double frequency_hz;
  double amplitude;  // unit of the command
};

inline constexpr double unlimited = std::numeric_limits<double>::infinity();

// A duration asked for in cycles and in seconds; the larger wins.
struct Span {
  double cycles = 0.0;
  double seconds = 0.0;
};

// The amplitude of the response that the command is to be fitted to, within its planned amplitude.
struct Level {
  double response = 0.0;       // wanted amplitude of the first response's output; 0 = no levelling
  double most_response = 0.0;  // more than this is tried again
  double least_amplitude = 0.0;  // of the command; where the first dwell begins
  std::uint32_t retries = 2;

  bool wanted() const { return response > 0.0; }
};

// One of the sweeps that a sweep by sub-bands consists of (Choe, "A Simple Method for Frequency
// Domain Identification", section 3, step 1).
struct SubBand {
  double start_hz = 0.0;
  double stop_hz = 0.0;
  std::uint32_t points = 0;
};

struct SweepSettings {
  Spacing spacing = Spacing::logarithmic;
  double start_hz = 0.0;
  double stop_hz = 0.0;
  std::uint32_t points = 0;
  // Where not empty: these sweeps one after the other, spaced alike, in place of the three above. A
  // frequency where one ends and the next begins is measured once, in the first.
  std::vector<SubBand> sub_bands;
  std::vector<double> frequencies_hz;  // for Spacing::list, in the order to be run
  double frequency_tolerance = 1e-3;   // relative, for the snap to whole cycles in whole samples
  std::uint32_t tones = 1;             // in one dwell, at most
  std::uint32_t refine_points = 0;     // added where the response is not known; 0 = none
  double refine_db = 0.5;              // known: two local models agree between points within this
  double tones_tolerance = 0.03;       // relative, of the tones above the lowest of a dwell
  bool odd_bins = false;               // every tone an odd number of cycles in the block

  double neutral = 0.0;                         // the command at rest
  double offset = 0.0;                          // from neutral: what the sines are laid on …
  double bias_amplitude = 0.0;                  // … and a slow oscillation about it,
  double bias_hz = 0.0;                         // which keeps a servo out of stiction
  double amplitude = 0.0;                       // unit of the command
  std::vector<AmplitudeBreak> amplitude_table;  // log-log interpolation, held beyond its ends
  double follow_velocity = unlimited;           // A·ω is kept at or below this
  double follow_acceleration = unlimited;       // A·ω² is kept at or below this

  Level level{};
  // A dwell moves from the amplitude before to its own in this time, and in half a cycle at least.
  double ramp_s = 0.0;

  Settling settling = Settling::detect;
  double check_fraction = 0.002;  // model: this part of the modelled dwells is measured both ways
  double probe_s = -1.0;          // model: length of the first pass; negative: of its own, 0: none
  Span settle{.cycles = 0.0, .seconds = 0.0};           // waited for before anything is measured
  Span settle_max{.cycles = 20.0, .seconds = 20.0};     // detect: how long settling may take
  Span integrate{.cycles = 1.0, .seconds = 0.1};        // at least
  Span integrate_max{.cycles = 20.0, .seconds = 20.0};  // at most, when the target is not reached
  Span block{.cycles = 1.0, .seconds = 0.02};
  double target_db = 0.05;  // half width of the 95 % interval of the gain; 0 = no target …
  double target_deg = 0.3;  // … and of the phase; without targets exactly `integrate` is measured
  bool target_of_first = false;  // of several responses, only the first has to meet the targets
  std::uint32_t harmonics = 3;   // highest harmonic of the tone that is watched
  double max_distortion = 0.1;

  bool has_target() const { return target_db > 0.0 || target_deg > 0.0; }
};

// What the command may ask of the rig; the plan is refused when a dwell would exceed it.
struct MotionLimits {
  double command_min = -unlimited;
  double command_max = unlimited;
  double slew_per_s = unlimited;        // |change of the command per tick| · rate
  double velocity_max = unlimited;      // A·ω
  double acceleration_max = unlimited;  // A·ω²
};

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

// A plan that can't be run: the message says what, `section` and `key` say which entry of the rig
// file to change.
class PlanRefused : public std::invalid_argument {
 public:
  PlanRefused(std::string section, std::string key, const std::string& what)
      : std::invalid_argument{what}, section_{std::move(section)}, key_{std::move(key)} {}
  const std::string& section() const { return section_; }
  const std::string& key() const { return key_; }

 private:
  std::string section_;
  std::string key_;
};

// The range of a sweep cut into `count` sub-bands of equal width, logarithmic or linear as its
// spacing, each with all its points.
std::vector<SubBand> equal_sub_bands(const SweepSettings& sweep, std::uint32_t count);

struct AskedFrequency {
  double hz = 0.0;
  std::uint32_t sub_band = 0;
};

// What the settings ask for, in running order, before it is snapped to the grid of the loop.
std::vector<AskedFrequency> asked_of(const SweepSettings& sweep);

// The frequencies asked for, in Hz and in running order, those of all sub-bands included.
std::vector<double> asked_frequencies(const SweepSettings& sweep);

// The amplitude at a frequency: the constant or the table, held under the velocity and acceleration
// that it is to follow.
double amplitude_at(const SweepSettings& sweep, double frequency_hz);

// Snaps, merges duplicates, sizes every dwell and checks it against the limits.
// Throws PlanRefused before anything moves.
SweepPlan plan_sweep(const SweepSettings& sweep, const MotionLimits& limits, double rate_hz);

}  // namespace sinerig
