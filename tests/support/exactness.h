// A sweep over a whole band and how far its points lie from the closed form.
#pragma once

#include <algorithm>
#include <complex>
#include <numbers>

#include <gtest/gtest.h>

#include "support/virtual_run.h"
#include "support/zero_order_hold.h"

namespace sinerig::test {

inline SweepSettings sweep_of_the_band(double rate_hz, double settle_s, std::uint32_t points = 40) {
  SweepSettings sweep;
  sweep.start_hz = 0.001 * rate_hz;
  sweep.stop_hz = 0.45 * rate_hz;
  sweep.points = points;
  sweep.amplitude = 0.7;
  sweep.settling = Settling::fixed;
  sweep.target_db = 0.0;
  sweep.target_deg = 0.0;
  sweep.settle = {.cycles = 2.0, .seconds = settle_s};
  sweep.integrate = {.cycles = 2.0, .seconds = 0.1};
  return sweep;
}

inline sim::SimulatedRigSettings rig_of(sim::LinearSystem system) {
  sim::SimulatedRigSettings rig;
  rig.system = std::move(system);
  rig.sensors.resize(1);
  return rig;
}

// Worst relative error of the points of one sensor; `exact(omega_rad_s)` is the closed form.
template <typename Exact>
double worst_error(const std::vector<Point>& points, std::uint16_t output, Exact exact) {
  long double worst = 0.0L;
  std::size_t seen = 0;
  for (const Point& point : points) {
    if (point.output != output) continue;
    ++seen;
    EXPECT_EQ(point.status, PointStatus::good)
        << to_string(point.reason) << " " << point.reason_value << " at " << point.frequency_hz
        << " Hz, SNR " << point.snr_db << " dB";
    const long double omega_rad_s =
        2.0L * std::numbers::pi_v<long double> * static_cast<long double>(point.frequency_hz);
    const Complex wanted = exact(omega_rad_s);
    const long double error = std::abs(Complex{point.response} - wanted) / std::abs(wanted);
    worst = error > worst || error != error ? error : worst;
  }
  EXPECT_GT(seen, 0U);
  return static_cast<double>(worst);
}

inline double worst_error(const SweepPlan& plan, const VirtualRun& run,
                          const PartialFractions& reference) {
  std::size_t tones = 0;
  for (const Dwell& dwell : plan.dwells) tones += dwell.tones.size();
  EXPECT_EQ(run.sink.points.size(), tones);
  return worst_error(run.sink.points, first_sensor_channel, [&](long double omega_rad_s) {
    return held_response(reference, omega_rad_s, 1.0L / static_cast<long double>(plan.rate_hz));
  });
}

}  // namespace sinerig::test
