#include "sweep/preflight.h"

#include <cmath>
#include <cstdio>
#include <numbers>

#include "sweep/records.h"

namespace sinerig {

namespace {

double phase_deg(const Point& point) noexcept {
  return std::arg(point.response) * 180.0 / std::numbers::pi;
}

// `phase` by whole turns to within half a turn of the middle of the range.
double turned_towards(double phase, double min, double max) noexcept {
  const double middle = 0.5 * (min + max);
  return middle + std::remainder(phase - middle, 360.0);
}

}  // namespace

Trip check_preflight(const PreflightSettings& settings, const Point& point, bool first) noexcept {
  const auto fails = [&](TripCause cause, double value, double limit) {
    return Trip{.cause = cause,
                .channel = static_cast<std::uint32_t>(point.output - first_sensor_channel),
                .value = value,
                .limit = limit};
  };
  const bool silent = point.reason == PointReason::no_response ||
                      point.reason == PointReason::stuck || !(point.output_amplitude > 0.0);
  if (silent) return fails(TripCause::preflight_silent, point.snr_db, 0.0);
  if (!(point.snr_db >= settings.min_snr_db)) {
    return fails(TripCause::preflight_noise, point.snr_db, settings.min_snr_db);
  }
  if (!first) return {};
  const double gain = std::abs(point.response);
  if (!(gain >= settings.min_gain)) {
    return fails(TripCause::preflight_gain, gain, settings.min_gain);
  }
  if (gain > settings.max_gain) return fails(TripCause::preflight_gain, gain, settings.max_gain);
  const double phase =
      turned_towards(phase_deg(point), settings.min_phase_deg, settings.max_phase_deg);
  if (phase < settings.min_phase_deg) {
    return fails(TripCause::preflight_phase, phase, settings.min_phase_deg);
  }
  if (phase > settings.max_phase_deg) {
    return fails(TripCause::preflight_phase, phase, settings.max_phase_deg);
  }
  return {};
}

Preflight preflight_of(const Point& point, bool passed, std::uint64_t tick) noexcept {
  return {.dwell = point.dwell,
          .tick = tick,
          .input = point.input,
          .output = point.output,
          .passed = passed,
          .frequency_hz = point.frequency_hz,
          .amplitude = point.input_amplitude,
          .gain = std::abs(point.response),
          .phase_deg = phase_deg(point),
          .snr_db = point.snr_db};
}

std::string describe(const Preflight& preflight, const std::vector<std::string>& channel_names) {
  const auto name = [&](std::size_t channel) {
    return channel < channel_names.size() ? channel_names[channel] : std::string{"?"};
  };
  char figures[160];
  std::snprintf(figures, sizeof figures, " at %.6g Hz, %.4g: gain %.4g, phase %.4g°, SNR %.3g dB",
                preflight.frequency_hz, preflight.amplitude, preflight.gain, preflight.phase_deg,
                preflight.snr_db);
  return std::string{preflight.passed ? "passed: " : "failed: "} + name(preflight.output) + "/" +
         name(preflight.input) + figures;
}

}  // namespace sinerig
