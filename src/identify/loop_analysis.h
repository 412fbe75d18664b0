// Margins, sensitivity peak, bandwidth and resonances of a loop, each with a 95 % interval.
//
// To first order every figure depends on the errors of L at one frequency only: with m = d ln|L|/dω
// and p = d arg L/dω, an error (x, y) of (ln|L|, arg L) moves a gain crossover by −x/m, the phase
// there by y − xp/m, a phase crossover by −y/p, the gain there by x − ym/p; at the peak of S the
// move of the frequency itself is of second order. (Implicit function theorem.)
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "identify/loop_curve.h"

namespace sinerig::identify {

// A value with its 95 % interval; of no width where the scatter is not known.
struct Bounded {
  double value = 0.0;
  double low = 0.0;
  double high = 0.0;
};

// Neighbouring measured frequencies in Hz that a figure is interpolated between; none for a model.
using Between = std::optional<std::pair<double, double>>;

struct GainMargin {
  Bounded frequency_hz;  // where arg L is an odd multiple of 180°
  Bounded margin_db;     // −20 log10|L|: the loop gain may rise by this much
  Between between_hz;
};

struct PhaseMargin {
  Bounded frequency_hz;  // where |L| = 1
  Bounded margin_deg;    // 180° + arg L, in (−180°, 180°]
  Bounded delay_s;       // of that phase at that frequency, a negative one counted as 360° more
  Between between_hz;
};

struct SensitivityPeak {
  double frequency_hz = 0.0;
  Bounded peak;  // Ms = max |S|, a ratio
  Between between_hz;
};

struct Resonance {
  double frequency_hz = 0.0;  // of the peak of |G|
  Bounded gain_db;
  double rise_db = 0.0;  // above the higher of the two valleys beside it
  Between between_hz;
};

struct LoopFigures {
  double searched_to_hz = 0.0;
  // All, by rising frequency; where L is real at 0 or half the rate, and negative, that counts.
  std::vector<GainMargin> phase_crossings;
  std::vector<PhaseMargin> gain_crossings;
  // Of a loop that is known to be stable: the least rise of the gain that ends that. Otherwise the
  // least margin at or above the first gain crossover, below zero where L encloses −1 there.
  std::optional<GainMargin> gain_margin;
  std::optional<GainMargin> gain_reduction;  // the least fall of the gain that ends stability
  std::optional<PhaseMargin> phase_margin;   // that of least magnitude
  std::optional<PhaseMargin> delay_margin;   // the crossover with the least delay
  SensitivityPeak sensitivity_peak;
  std::optional<Bounded> bandwidth_hz;  // |T| falls through 1/√2 for the first time
  Between bandwidth_between_hz;
  std::vector<Resonance> resonances;  // of L
};

// stable: whether the closed loop is, where that is known (closed_loop.h).
LoopFigures analyse_loop(const Curve& loop, std::optional<bool> stable = std::nullopt);

// Peaks of |G| that rise 3 dB above both of the valleys beside them, by rising frequency.
std::vector<Resonance> resonances(const Curve& curve);

}  // namespace sinerig::identify
