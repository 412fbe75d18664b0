// The plants G1 to G4 of config/quality with their exact responses, and the drive and noise that
// the tables ask for.
#pragma once

#include <complex>
#include <cstdint>
#include <string>
#include <vector>

#include "sim/simulated_rig.h"
#include "support/zero_order_hold.h"
#include "sweep/plan.h"

namespace sinerig::quality {

struct QualityPlant {
  std::string name;
  double rate_hz = 0.0;
  SweepSettings sweep{};
  sim::LinearSystem system;
  test::PartialFractions modes;

  // From command samples to output samples, of the plant behind its hold.
  std::complex<double> response(double frequency_hz) const;

  // The same, referred to their true times, of samples scattered evenly over `jitter_s` before the
  // tick: between the ticks the output of a held input is no pure sine.
  std::complex<double> response(double frequency_hz, double jitter_s) const;
};

// "g1" … "g4" from the rig file of that name in `folder`.
QualityPlant load_plant(const std::string& folder, const std::string& name);

// Poles and residues of a system whose poles are simple.
test::PartialFractions modal_form(const sim::LinearSystem& system);

// How loud the noise is.
enum class Noise {
  n80,  // flat drive, noise 80 dB below the peak of the response
  n60,
  l20,  // drive levelled so that every response is 20 dB above the noise
};
const char* to_string(Noise noise);

// A sweep over a plant at one of the noise levels.
struct QualityCase {
  QualityPlant plant;
  SweepPlan plan;
  double noise_rms = 0.0;

  sim::SimulatedRigSettings rig(std::uint64_t seed) const;
};

QualityCase make_case(const QualityPlant& plant, Noise noise);

// Errors of a measured response, in the unit that the bounds have.
struct ResponseError {
  double gain_db = 0.0;
  double phase_deg = 0.0;
};
ResponseError error_of(std::complex<double> measured, std::complex<double> truth);

// Of every point of a sweep: what counts as equally accurate.
inline constexpr double bound_db = 0.1;
inline constexpr double bound_deg = 1.0;
inline bool within_bounds(const ResponseError& error) {
  return error.gain_db <= bound_db && error.phase_deg <= bound_deg;
}

}  // namespace sinerig::quality
