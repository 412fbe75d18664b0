// What a sweep is asked to be, as the rig file says it: the sine and where it runs, how long a
// dwell waits and measures, and what the motion may not exceed. plan.h makes dwells of it.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

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

}  // namespace sinerig
