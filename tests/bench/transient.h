// `tools/bench transient`: sweeps whose transients are modelled, against the best fixed rules, with
// noise, priors and losses of every kind.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "quality_plants.h"
#include "sweep/known_modes.h"

namespace sinerig::transient {

struct Options {
  std::uint32_t seeds = 20;
  std::uint64_t first_seed = 1001;
  std::string rigs;
  bool each = false;               // tells of every sweep
  std::vector<std::string> cases;  // "g1_80"; empty: all

  bool wants(const std::string& name) const;
};

// Plant and noise with the seconds of the best fixed rule with a minimum integration time that was
// tuned for it: column "timed" of `tools/bench quality time`, which finds it.
struct Case {
  std::string name;
  const char* plant;
  quality::Noise noise;
  double fixed_s;
};
const std::vector<Case>& cases();

// What goes wrong beside the noise.
struct Trouble {
  bool pink = false;       // the noise is 1/f
  double lost = 0.0;       // part of the samples
  bool told = false;       // the modes are told, not found
  double frequency = 0.0;  // how wrong they are told, relative
  double decay = 0.0;
  double missing_hz = 0.0;  // a mode that is not told
  double added_hz = 0.0;    // a mode that there is not
};

// All sweeps of a cell together.
struct Tally {
  double seconds = 0.0;  // per sweep
  double within = 0.0;   // part of the sweeps within 0.1 dB and 1 degree
  double within_or_flagged = 0.0;
  double coverage = 0.0;
  double worst_db = 0.0;
  double detected = 0.0;         // points per sweep whose transient was waited for
  std::uint32_t silent = 0;      // good points beyond twice the target
  std::uint32_t beyond_cap = 0;  // dwells longer than they may be
};

Tally measure(const Case& of, const Options& options, double cycles, const Trouble& trouble);

int bench_time(const Options& options);
int coverage(const Options& options);
int order(const Options& options);
int tick(const Options& options);

}  // namespace sinerig::transient
