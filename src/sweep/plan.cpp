#include "sweep/plan.h"

#include <algorithm>
#include <cmath>

#include "sweep/asked_frequencies.h"
#include "sweep/dwell_sizing.h"
#include "sweep/motion_check.h"
#include "sweep/multitone.h"
#include "sweep/point_interval.h"
#include "sweep/probe.h"

namespace sinerig {

namespace {

// A gap of the first pass is divided into this many for refinement, fewer where all gaps together
// would have more candidates.
constexpr std::size_t finest_pieces = 64;
constexpr std::size_t most_candidates = 20'000;

// A candidate may follow any dwell: it always has the ramp of a change.
const Dwell any_dwell{.tones = {{}, {}}};
const Dwell at_rest{.tones = {{}}};

void check_band(const SweepSettings& sweep, double rate_hz) {
  const auto check = [&](const char* key, double frequency_hz) {
    if (frequency_hz > 0.0 && frequency_hz < rate_hz / max_dwell_samples) {
      throw PlanRefused("sweep", key,
                        number(frequency_hz) + " Hz: a cycle would last " +
                            number(1.0 / frequency_hz) + " s; " +
                            number(rate_hz / max_dwell_samples) + " Hz is the lowest at this rate");
    }
    if (frequency_hz > 0.0 && frequency_hz < rate_hz / 2.0) return;
    throw PlanRefused("sweep", key,
                      number(frequency_hz) + ": must be above 0 and below half the loop rate (" +
                          number(rate_hz / 2.0) + " Hz)");
  };
  if (sweep.spacing == Spacing::list) {
    for (const double frequency_hz : sweep.frequencies_hz) check("frequencies_hz", frequency_hz);
    return;
  }
  for (const SubBand& band : sweep.sub_bands) {
    check("sub_band_table", band.start_hz);
    check("sub_band_table", band.stop_hz);
  }
  if (!sweep.sub_bands.empty()) return;
  check("start_hz", sweep.start_hz);
  check("stop_hz", sweep.stop_hz);
}

Baseline make_baseline(const SweepSettings& sweep, const MotionLimits& limits, double rate_hz) {
  Baseline baseline{.neutral = sweep.neutral, .offset = sweep.offset};
  baseline.max_step = limits.slew_per_s / rate_hz;
  baseline.ramp_samples = static_cast<std::uint64_t>(std::ceil(sweep.ramp_s * rate_hz - 1e-9));
  if (sweep.bias_amplitude > 0.0) {
    baseline.amplitude = sweep.bias_amplitude;
    baseline.oscillation = snap(sweep.bias_hz, rate_hz, sweep.frequency_tolerance);
  }
  return baseline;
}

// The bias motion becomes a bin of its own; a harmonic that it falls on is not watched, nor are
// those above.
void lay_on(const Baseline& baseline, Dwell& dwell, double rate_hz) {
  const double bias_hz = baseline.oscillation.hz(rate_hz);
  check_bias(dwell, bias_hz, rate_hz);
  dwell.bias_hz = bias_hz;
  const double resolved_hz = rate_hz / static_cast<double>(dwell.max_samples);
  for (std::uint32_t order = 2; order <= dwell.harmonics; ++order) {
    if (std::abs(order * dwell.frequency_hz(rate_hz) - bias_hz) < resolved_hz)
      dwell.harmonics = order - 1;
  }
}

struct AskedGroup {
  std::vector<double> frequencies_hz;
  std::uint32_t sub_band = 0;
};

// What is measured in one dwell each; no group reaches over the edge of a sub-band.
std::vector<AskedGroup> groups_of(const std::vector<AskedFrequency>& asked, std::size_t tones) {
  std::vector<AskedGroup> groups;
  for (std::size_t first = 0; first < asked.size();) {
    const std::uint32_t sub_band = asked[first].sub_band;
    std::vector<double> band;
    for (; first < asked.size() && asked[first].sub_band == sub_band; ++first)
      band.push_back(asked[first].hz);
    if (tones > 1) {
      for (const auto& group : interleaved(band, tones)) groups.push_back({group, sub_band});
    } else {
      for (const double hz : band) groups.push_back({{hz}, sub_band});
    }
  }
  return groups;
}

bool same_frequency(const Dwell& a, const Dwell& b) {
  if (a.tones.size() > 1 || b.tones.size() > 1) return false;
  return a.tones.front().cycles * b.block_samples == b.tones.front().cycles * a.block_samples;
}

Refinement make_refinement(const SweepPlan& plan, const SweepSettings& sweep,
                           const MotionLimits& limits) {
  std::vector<double> measured_hz;
  for (const Dwell& dwell : plan.dwells) {
    for (const Tone& tone : dwell.tones) measured_hz.push_back(dwell.tone_hz(tone, plan.rate_hz));
  }
  std::sort(measured_hz.begin(), measured_hz.end());
  Refinement refinement{
      .candidates = {}, .most_points = sweep.refine_points, .tolerance_db = sweep.refine_db};
  const std::size_t gaps = measured_hz.size() - 1;
  std::size_t pieces = finest_pieces;
  while (pieces > 2 && gaps * (pieces - 1) > most_candidates) pieces /= 2;
  double last_hz = 0.0;
  for (std::size_t gap = 0; gap < gaps; ++gap) {
    const double ratio = measured_hz[gap + 1] / measured_hz[gap];
    for (std::size_t i = 1; i < pieces; ++i) {
      const double asked_hz =
          measured_hz[gap] * std::pow(ratio, static_cast<double>(i) / static_cast<double>(pieces));
      Dwell dwell = make_single(asked_hz, sweep, plan.rate_hz, &any_dwell);
      const double exact_hz = dwell.frequency_hz(plan.rate_hz);
      if (exact_hz <= last_hz || exact_hz <= measured_hz[gap] || exact_hz >= measured_hz[gap + 1]) {
        continue;
      }
      // What the limits do not allow is no candidate: the first pass has been checked.
      try {
        if (plan.baseline.oscillates()) lay_on(plan.baseline, dwell, plan.rate_hz);
        check_motion(sweep, limits, dwell, plan.rate_hz);
        check_ramp(dwell, &at_rest, unlimited, plan.baseline, limits, plan.rate_hz);
      } catch (const PlanRefused&) {
        continue;
      }
      last_hz = exact_hz;
      refinement.candidates.push_back(std::move(dwell));
    }
  }
  return refinement;
}

}  // namespace

std::uint64_t SweepPlan::min_samples() const {
  std::uint64_t sum = probe.command.size();
  for (const Dwell& dwell : dwells) sum += dwell.min_samples();
  return sum;
}

std::uint64_t SweepPlan::max_samples() const {
  std::uint64_t sum = probe.command.size();
  for (const Dwell& dwell : dwells) sum += dwell.max_samples;
  return sum + refinement.max_samples();
}

std::uint64_t Refinement::max_samples() const {
  std::uint64_t longest = 0;
  for (const Dwell& dwell : candidates) longest = std::max(longest, dwell.max_samples);
  return std::min<std::uint64_t>(most_points, candidates.size()) * longest;
}

std::size_t SweepPlan::most_tones() const {
  std::size_t most = 1;
  for (const Dwell& dwell : dwells) most = std::max(most, dwell.tones.size());
  return most;
}

std::size_t SweepPlan::most_bins() const {
  std::size_t most = 1;
  for (const Dwell& dwell : dwells) most = std::max(most, dwell.bins());
  for (const Dwell& dwell : refinement.candidates) most = std::max(most, dwell.bins());
  return most;
}

double Judgement::relative_target() const {
  return has_target() ? smaller_target(target_db, target_deg) : 1e-3;
}

SweepPlan plan_sweep(const SweepSettings& sweep, const MotionLimits& limits, double rate_hz) {
  const std::vector<AskedFrequency> asked = asked_of(sweep);
  if (asked.empty()) {
    throw PlanRefused("sweep", "points", "no frequency to measure: give at least one");
  }
  check_band(sweep, rate_hz);

  SweepPlan plan{.rate_hz = rate_hz,
                 .baseline = make_baseline(sweep, limits, rate_hz),
                 .level = sweep.level,
                 .dwells = {}};
  check_baseline(plan.baseline, limits, rate_hz);
  plan.judgement = {.settling = sweep.settling,
                    .target_db = sweep.target_db,
                    .target_deg = sweep.target_deg,
                    .target_of_first = sweep.target_of_first,
                    .check_fraction = sweep.check_fraction,
                    .max_distortion = sweep.max_distortion};
  for (const AskedGroup& group : groups_of(asked, sweep.tones)) {
    const Dwell* before = plan.dwells.empty() ? nullptr : &plan.dwells.back();
    Dwell dwell = make_group(group.frequencies_hz, sweep, rate_hz, before);
    dwell.sub_band = group.sub_band;
    const bool duplicate =
        std::any_of(plan.dwells.begin(), plan.dwells.end(),
                    [&](const Dwell& other) { return same_frequency(dwell, other); });
    if (duplicate) continue;
    check_motion(sweep, limits, dwell, rate_hz);
    if (plan.baseline.oscillates()) lay_on(plan.baseline, dwell, rate_hz);
    check_ramp(dwell, before, sweep.level.wanted() ? sweep.level.least_amplitude : unlimited,
               plan.baseline, limits, rate_hz);
    plan.dwells.push_back(std::move(dwell));
  }
  plan.probe = make_probe(sweep, limits, rate_hz);
  if (sweep.refine_points > 0) plan.refinement = make_refinement(plan, sweep, limits);
  return plan;
}

}  // namespace sinerig
