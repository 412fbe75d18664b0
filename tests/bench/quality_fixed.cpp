#include "quality_fixed.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace sinerig::quality {

namespace {

constexpr double two_pi = 2.0 * std::numbers::pi;
constexpr double wanted_success = 0.95;

// P(|x| <= bound) of a Gaussian with this mean and standard deviation.
double inside(double mean, double deviation, double bound) {
  const double scale = 1.0 / (deviation * std::numbers::sqrt2);
  return 0.5 * (std::erf((bound - mean) * scale) + std::erf((bound + mean) * scale));
}

std::vector<double> geometric(double first, double last, double ratio) {
  std::vector<double> values;
  for (double value = first; value <= last; value *= ratio) values.push_back(value);
  return values;
}

}  // namespace

FixedRuleModel::FixedRuleModel(const QualityCase& of)
    : rate_hz_{of.plan.rate_hz},
      delay_samples_{static_cast<double>(of.plant.modes.delay_s) * of.plan.rate_hz} {
  const std::complex<double> j{0.0, 1.0};
  double before_omega = 0.0;  // of the dwell before, per sample
  double before_amplitude = 0.0;
  for (const Dwell& dwell : of.plan.dwells) {
    const double hz = dwell.frequency_hz(rate_hz_);
    const double omega = two_pi * hz / rate_hz_;
    const double amplitude = dwell.tones.front().amplitude;
    const std::complex<double> response = of.plant.response(hz);
    DwellModel model;
    model.samples_per_cycle = rate_hz_ / hz;
    model.noise = std::numbers::sqrt2 * of.noise_rms / (amplitude * std::abs(response));
    for (std::size_t i = 0; i < of.plant.modes.poles.size(); ++i) {
      const std::complex<double> pole{of.plant.modes.poles[i]};
      const std::complex<double> residue{of.plant.modes.residues[i]};
      const std::complex<double> z = std::exp(pole / rate_hz_);
      const std::complex<double> gain = (z - 1.0) / pole;
      // The mode's steady state at the phase zero of a sine, where one dwell hands over to the
      // next.
      const auto steady = [&](double at_omega) {
        const auto up = gain / (std::exp(j * at_omega) - z);
        const auto down = gain / (std::exp(-j * at_omega) - z);
        return (up - down) / (2.0 * j);
      };
      const auto handed_over =
          before_amplitude > 0.0 ? before_amplitude * steady(before_omega) : 0.0;
      const std::complex<double> start = residue * (handed_over - amplitude * steady(omega));
      const std::complex<double> log_ratio = pole / rate_hz_ - j * omega;
      // H's error from the window [a, b): 2j / (N A) Σ y e^{−jωn}, y = start · z^{n − delay}.
      const std::complex<double> weight = 2.0 * j / amplitude * start *
                                          std::exp(-pole / rate_hz_ * delay_samples_) /
                                          (1.0 - std::exp(log_ratio)) / response;
      model.modes.push_back({.log_ratio = log_ratio, .weight = weight});
    }
    dwells_.push_back(std::move(model));
    before_omega = omega;
    before_amplitude = amplitude;
  }
}

FixedRuleModel::Lengths FixedRuleModel::lengths(const DwellModel& dwell,
                                                const FixedRule& rule) const {
  const double cycles =
      std::max(rule.integrate_cycles,
               std::ceil(rule.integrate_s * rate_hz_ / dwell.samples_per_cycle - 1e-9));
  const double settle =
      std::max(rule.settle_cycles * dwell.samples_per_cycle, rule.settle_s * rate_hz_);
  return {.settle = std::ceil(settle), .integrate = std::round(cycles * dwell.samples_per_cycle)};
}

double FixedRuleModel::seconds(const FixedRule& rule) const {
  double samples = 0.0;
  for (const DwellModel& dwell : dwells_) {
    const Lengths each = lengths(dwell, rule);
    samples += each.settle + each.integrate;
  }
  return samples / rate_hz_;
}

double FixedRuleModel::point_success(const DwellModel& dwell, const FixedRule& rule,
                                     double scale) const {
  const Lengths length = lengths(dwell, rule);
  const double begin = std::max(length.settle, std::ceil(delay_samples_));
  const double end = begin + length.integrate;
  std::complex<double> left = 0.0;
  for (const ModeAtPoint& mode : dwell.modes) {
    left += mode.weight * (std::exp(mode.log_ratio * begin) - std::exp(mode.log_ratio * end));
  }
  left = std::log(1.0 + left / length.integrate);
  const double noise = dwell.noise / std::sqrt(length.integrate);
  return inside(left.real(), noise, scale * bound_db * std::numbers::ln10 / 20.0) *
         inside(left.imag(), noise, scale * bound_deg * two_pi / 360.0);
}

double FixedRuleModel::success(const FixedRule& rule, double scale, double enough) const {
  double product = point_success(dwells_[hardest_], rule, scale);
  const std::size_t first = hardest_;
  for (std::size_t i = 0; i < dwells_.size() && product >= enough; ++i) {
    if (i == first) continue;
    const double each = point_success(dwells_[i], rule, scale);
    product *= each;
    if (product < enough) hardest_ = i;
  }
  return product;
}

double FixedRuleModel::success(const FixedRule& rule) const {
  return success(rule, 1.0, 0.0);
}

bool FixedRuleModel::reaches(const FixedRule& rule) const {
  return success(rule, 1.0, wanted_success) >= wanted_success;
}

double FixedRuleModel::worst_error(const FixedRule& rule) const {
  double low = 1e-3;
  double high = 1e4;
  while (high / low > 1.01) {
    const double middle = std::sqrt(low * high);
    (success(rule, middle, wanted_success) >= wanted_success ? high : low) = middle;
  }
  return high;
}

FixedRule best_fixed_rule(const FixedRuleModel& model, bool with_integration_time) {
  std::vector<double> settle_cycles{0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0};
  for (const double more : geometric(7.5, 100.0, 1.25)) settle_cycles.push_back(more);
  std::vector<double> settle_s{0.0};
  for (const double more : geometric(0.002, 60.0, 1.05)) settle_s.push_back(more);
  std::vector<double> cycles;
  for (const double each : geometric(1.0, 20000.0, 1.03)) {
    if (cycles.empty() || std::round(each) > cycles.back()) cycles.push_back(std::round(each));
  }
  std::vector<double> integrate_s{0.0};
  if (with_integration_time) {
    for (const double more : geometric(0.002, 2000.0, 1.04)) integrate_s.push_back(more);
  }

  FixedRule best;
  double best_seconds = std::numeric_limits<double>::infinity();
  const auto seconds_of = [&](double a, double b, double c, double d) {
    return model.seconds({a, b, c, d});
  };
  // Time grows with every part of the rule: what is already slower than the best is cut off.
  for (const double a : settle_cycles) {
    if (seconds_of(a, 0.0, 1.0, 0.0) >= best_seconds) break;
    for (const double b : settle_s) {
      if (seconds_of(a, b, 1.0, 0.0) >= best_seconds) break;
      for (const double c : cycles) {
        if (with_integration_time && c > 60.0) break;
        if (seconds_of(a, b, c, 0.0) >= best_seconds) break;
        for (const double d : integrate_s) {
          const FixedRule rule{a, b, c, d};
          const double seconds = model.seconds(rule);
          if (seconds >= best_seconds) break;
          if (!model.reaches(rule)) continue;
          best = rule;
          best_seconds = seconds;
          break;
        }
      }
    }
  }
  return best;
}

}  // namespace sinerig::quality
