// Runs as a reader would return them, made from a closed form: for tests of reports and formats.
#pragma once

#include <cmath>
#include <complex>
#include <cstdint>
#include <numbers>
#include <string>

#include "record/sweep_reader.h"

namespace sinerig::test {

// k / (s/ω0 + 1) with ω0 = 2π · 10 rad/s.
inline std::complex<double> lag_at(double frequency_hz, double gain) {
  return gain / std::complex<double>{1.0, frequency_hz / 10.0};
}

inline record::StoredPoint lag_point(std::uint32_t dwell, double frequency_hz, double gain,
                                     std::uint32_t output) {
  const std::complex<double> response = lag_at(frequency_hz, gain);
  const double variance = std::norm(response) * 1e-6;
  return {.dwell = dwell,
          .tone = 0,
          .input = 1,
          .output = output,
          .frequency_hz = frequency_hz,
          .response = response,
          .covariance = {variance, 0.25 * variance, 2.0 * variance},
          .dof = 14.0,
          .gain_interval_db = 8.685889638 * 2e-3,
          .phase_interval_deg = 57.29577951 * 3e-3,
          .input_amplitude = 0.5,
          .output_amplitude = 0.5 * std::abs(response),
          .snr_db = 46.0,
          .coherence = 1.0 - 1.0 / (3.0 * frequency_hz),
          .distortion = 0.002,
          .drift_per_s = 0.0,
          .samples = 8000.0,
          .lost = 0.0,
          .seconds = 9.0,
          .status = "good",
          .reason = "",
          .reason_value = 0.0,
          .settled_by = dwell % 2 == 0 ? "detection" : "model",
          .more = {}};
}

// `points` points of two channels from 1 to 100 Hz; the statuses of the last ones of the first
// channel are not good, one has no response at all.
inline record::StoredRun two_channel_run(std::size_t points) {
  record::StoredRun run;
  run.facts = {{"rig_name", "bench/axis.toml"},
               {"rig_text", "[loop]\nrate_hz = 1000  # <fast> & \"sound\"\n"},
               {"rate_hz", "1000"},
               {"clock", "monotonic"},
               {"started_utc", "2026-03-01T22:14:05Z"},
               {"outcome", "done"}};
  run.channels = {{"command", "Nm"}, {"applied", "Nm"}, {"encoder", "rad"}, {"gyro", "rad/s"}};
  run.plan.rate_hz = 1000.0;
  run.responses = {{1, 2, {}}, {1, 3, {}}};
  const double last = static_cast<double>(points > 1 ? points - 1 : 1);
  for (std::uint32_t i = 0; i < points; ++i) {
    const double frequency_hz = std::pow(10.0, 2.0 * i / last);
    Dwell dwell{.asked_hz = frequency_hz, .block_samples = 1000, .tones = {}, .blocks = 8};
    dwell.tones.push_back({.cycles = i + 1, .amplitude = 0.5, .phase_rad = 0.0});
    run.plan.dwells.push_back(dwell);
    run.responses[0].points.push_back(lag_point(i, frequency_hz, 2.0, 2));
    run.responses[1].points.push_back(lag_point(i, frequency_hz, 20.0, 3));
    run.timings.push_back({.dwell = i,
                           .first_tick = i * 9000U,
                           .ticks = 9000,
                           .skipped = i == 2 ? 3U : 0U,
                           .resettles = 0,
                           .max_lateness_ns = 20000 + 1000 * i,
                           .lateness_us = "8000 900 90 9 1",
                           .usage = ThreadUsage{.minor_faults = i == 0 ? 12U : 0U,
                                                .major_faults = i == 0 ? 1U : 0U,
                                                .involuntary_switches = i % 5}});
  }
  run.events = {{.tick = 18000,
                 .dwell = 2,
                 .kind = "gap",
                 .channel = 0,
                 .fault = "none",
                 .value = 3.0,
                 .detail = ""}};
  auto& first = run.responses[0].points;
  const char* const statuses[] = {"unsettled", "low_signal", "clipped",
                                  "distorted", "rt_fault",   "stopped"};
  for (std::size_t i = 0; i < std::size(statuses) && i + 1 < points; ++i)
    first[points - 1 - i].status = statuses[i];
  if (points > 6) {
    first[points - 1].response = {std::nan(""), std::nan("")};
    first[points - 1].covariance = {std::nan(""), std::nan(""), std::nan("")};
    first[points - 1].dof = 0.0;
    first[points - 1].gain_interval_db = std::nan("");
    first[points - 1].phase_interval_deg = std::nan("");
  }
  return run;
}

// The model that the first channel of two_channel_run follows exactly.
inline record::StoredFit lag_fit() {
  const double omega = 2.0 * std::numbers::pi * 10.0;
  return {.input = 1,
          .output = 2,
          .label = "ml",
          .num = {2.0 * omega},
          .den = {1.0, omega},
          .delay_s = 0.0,
          .hold_period_s = 0.0,
          .path_delay_s = 0.0,
          .gain = 2.0 * omega,
          .poles = {-omega},
          .zeros = {},
          .facts = {{"chi2", "1.02"}}};
}

}  // namespace sinerig::test
