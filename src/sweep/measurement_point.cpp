// What a dwell says of its points: figures, intervals, a status and the reason for it.
#include <cmath>
#include <limits>
#include <numbers>

#include "sweep/measurement.h"

namespace sinerig {

namespace {

constexpr double db_per_relative = 20.0 / std::numbers::ln10;

// One cluster this much louder than the others is a burst, if it also stands out statistically.
// At 6 the end of a transient was taken for a burst in 2 of 1000 clean points.
constexpr double burst_ratio = 25.0;

// An amplitude below this part of the output's rms about its first sample is no amplitude.
constexpr double rounding = 1e-12;

}  // namespace

SettledBy Measurement::settled_by() const noexcept {
  if (judgement_.settling == Settling::fixed) return SettledBy::wait;
  if (by_model_) return SettledBy::model;
  if (check_) return SettledBy::both;
  return modal_ && modal_->abandoned() ? SettledBy::fallback : SettledBy::detection;
}

Point Measurement::point(std::size_t pair, std::size_t tone) const noexcept {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const Result& each = result(pair, tone);
  const Estimate& estimate = each.estimate;
  Point point;
  point.tone = static_cast<std::uint16_t>(tone);
  point.pair = static_cast<std::uint16_t>(pair);
  point.input = static_cast<std::uint16_t>(applied_channel + pairs_[pair].input);
  point.output = static_cast<std::uint16_t>(applied_channel + pairs_[pair].output);
  point.frequency_hz = omega_[tone] / (2.0 * std::numbers::pi);
  if (!each.known) {
    point.response = {nan, nan};
    point.covariance = {nan, nan, nan};
    point.gain_interval_db = nan;
    point.phase_interval_deg = nan;
    point.status = PointStatus::low_signal;
    point.reason = each.no_input ? PointReason::no_excitation : PointReason::no_data;
    return point;
  }
  const Interval half = interval(each);
  const double gain = std::abs(estimate.response);
  point.settled_by = settled_by();
  point.response = estimate.response;
  point.covariance = each.variance.covariance;
  point.dof = each.variance.dof;
  point.gain_interval_db = half.gain_db;
  point.phase_interval_deg = half.phase_deg;
  point.input_amplitude = std::abs(estimate.input);
  point.output_amplitude = std::abs(estimate.output);
  point.snr_db =
      20.0 * std::log10(point.output_amplitude / std::numbers::sqrt2 / estimate.residual_rms);
  point.distortion = estimate.distortion;
  point.drift_per_s =
      estimate.drift_per_block / static_cast<double>(dwell_->block_samples) * rate_hz_;
  point.samples = estimate.samples;
  point.lost = estimate.lost;
  const double loud = estimate.burst - 1.0;
  const double samples_per_cluster = estimate.samples / (0.5 * estimate.scatter_dof + 1.0);
  // Below this the residual is the rounding of the running totals (131 dB at 100 kHz), which has no
  // statistics.
  const bool real_noise = estimate.residual_rms > 1e-6 * estimate.rms;
  const bool burst = real_noise && estimate.burst > burst_ratio &&
                     loud > 8.0 * std::sqrt(2.0 / samples_per_cluster);
  const auto mark = [&](PointStatus status, PointReason reason, double value) {
    point.status = status;
    point.reason = reason;
    point.reason_value = value;
  };
  // What has stopped in the midst of a dwell leaves the rounding of the totals.
  if (point.output_amplitude <= rounding * estimate.rms && !real_noise) {
    mark(PointStatus::low_signal, PointReason::stuck, 0.0);
  } else if (!each.still) {
    mark(PointStatus::unsettled, PointReason::still_moving, db_per_relative * each.left);
  } else if (burst) {
    mark(PointStatus::low_signal, PointReason::noise_burst, estimate.burst);
  } else if (estimate.own_distortion > judgement_.max_distortion) {
    mark(PointStatus::distorted, PointReason::harmonics, estimate.own_distortion);
  } else if (by_model_ && at_limit_ && !modal_->accepted()) {
    mark(PointStatus::unsettled, PointReason::model_at_limit, half.gain_db);
  } else if (!target_met(pair, true)) {
    mark(PointStatus::low_signal, PointReason::target_not_reached, half.gain_db);
  } else if (!(gain > 0.0)) {
    mark(PointStatus::low_signal, PointReason::no_response, 0.0);
  }
  return point;
}

}  // namespace sinerig
