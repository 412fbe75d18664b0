// Fixed rules (settle so long, integrate so long) on a known plant and noise, without simulating:
// the leftover transient of a window is a geometric sum over the modes, the noise of a window is
// Gaussian with a known variance. This is how the rules that adaptive dwells are compared with get
// tuned.
#pragma once

#include <complex>
#include <vector>

#include "quality_plants.h"

namespace sinerig::quality {

// Waits for max(settle_cycles, settle_s), then integrates max(integrate_cycles, integrate_s),
// rounded up to whole cycles.
struct FixedRule {
  double settle_cycles = 0.0;
  double settle_s = 0.0;
  double integrate_cycles = 1.0;
  double integrate_s = 0.0;
};

class FixedRuleModel {
 public:
  explicit FixedRuleModel(const QualityCase& of);

  double seconds(const FixedRule& rule) const;

  // Probability that every point is within the bounds.
  double success(const FixedRule& rule) const;

  bool reaches(const FixedRule& rule) const;  // … in 95 % of the sweeps

  // Error that 95 % of the sweeps stay within at every point: the smallest multiple of the bounds
  // that reaches it.
  double worst_error(const FixedRule& rule) const;

 private:
  struct ModeAtPoint {
    std::complex<double> log_ratio;  // ln(z e^{−jω}) of the mode against the tone, per sample
    std::complex<double> weight;     // of its transient in the tone's coefficient, over H
  };
  struct DwellModel {
    double samples_per_cycle = 0.0;
    double noise = 0.0;  // of one component of H / H, for one sample
    std::vector<ModeAtPoint> modes;
  };
  struct Lengths {
    double settle = 0.0;
    double integrate = 0.0;
  };

  Lengths lengths(const DwellModel& dwell, const FixedRule& rule) const;
  double point_success(const DwellModel& dwell, const FixedRule& rule, double scale) const;
  double success(const FixedRule& rule, double scale, double enough) const;

  double rate_hz_;
  double delay_samples_;
  std::vector<DwellModel> dwells_;
  mutable std::size_t hardest_ = 0;  // the point that failed last is tried first
};

// The quickest rule that keeps every point within the bounds in 95 % of the sweeps, without or with
// a minimum integration time.
FixedRule best_fixed_rule(const FixedRuleModel& model, bool with_integration_time);

}  // namespace sinerig::quality
