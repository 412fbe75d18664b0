// What has to be known of a plant before the transients of a sweep can be modelled, and who finds
// it out.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "sweep/mode_prior.h"

namespace sinerig {

struct KnownModes {
  ModePrior prior{};
  std::vector<double> noise_variance{};  // of every response's output, its unit squared
  double noise_dof = 0.0;
};

// A motion that excites all modes at once, tick by tick from rest.
struct ProbeRecord {
  double period_s = 0.0;
  double low_hz = 0.0;  // the band that was excited
  double high_hz = 0.0;
  std::span<const double> applied;
  // Of each response's output; not a number where a sample is missing.
  std::vector<std::span<const double>> outputs;
};

class ModeFinder {
 public:
  virtual ~ModeFinder() = default;

  // Called while the loop holds the rig at rest, on another thread where time is real: may take its
  // time and allocate. False where no modes can be told from the record.
  virtual bool find(const ProbeRecord& record, KnownModes& found) noexcept = 0;
};

}  // namespace sinerig
