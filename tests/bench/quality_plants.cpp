#include "quality_plants.h"

#include <cmath>
#include <numbers>

#include <Eigen/Dense>

#include "config/rig.h"
#include "sim/sim_driver.h"
#include "sweep/asked_frequencies.h"

namespace sinerig::quality {

namespace {

constexpr double two_pi = 2.0 * std::numbers::pi;

double peak_gain(const QualityPlant& plant) {
  double peak = 0.0;
  constexpr int steps = 20000;
  for (int i = 0; i <= steps; ++i) {
    const double position = static_cast<double>(i) / steps;
    const double hz =
        plant.sweep.start_hz * std::pow(plant.sweep.stop_hz / plant.sweep.start_hz, position);
    peak = std::max(peak, std::abs(plant.response(hz)));
  }
  return peak;
}

}  // namespace

std::complex<double> QualityPlant::response(double frequency_hz) const {
  return std::complex<double>{test::held_response(modes, two_pi * frequency_hz, 1.0 / rate_hz)};
}

std::complex<double> QualityPlant::response(double frequency_hz, double jitter_s) const {
  constexpr int steps = 32;
  std::complex<double> sum{};
  for (int i = 0; i < steps; ++i) {
    const double age_s = jitter_s * (i + 0.5) / steps;
    const auto there = test::held_response(modes, two_pi * frequency_hz, 1.0 / rate_hz, age_s);
    sum += std::complex<double>{there} * std::polar(1.0, two_pi * frequency_hz * age_s);
  }
  return sum / static_cast<double>(steps);
}

test::PartialFractions modal_form(const sim::LinearSystem& system) {
  const Eigen::EigenSolver<Eigen::MatrixXd> solver{system.a};
  const Eigen::MatrixXcd vectors = solver.eigenvectors();
  const Eigen::VectorXcd input =
      vectors.partialPivLu().solve(system.b.cast<std::complex<double>>());
  const Eigen::RowVectorXcd output = system.c.row(0).cast<std::complex<double>>() * vectors;
  test::PartialFractions modes;
  for (Eigen::Index i = 0; i < system.a.rows(); ++i) {
    modes.poles.emplace_back(solver.eigenvalues()[i]);
    modes.residues.emplace_back(input[i] * output[i]);
  }
  modes.direct = system.d[0];
  modes.delay_s = system.dead_time_s;
  return modes;
}

QualityPlant load_plant(const std::string& folder, const std::string& name) {
  const config::Rig rig = config::read_rig(config::RigFile::load(folder + "/" + name + ".toml"));
  QualityPlant plant;
  plant.name = name;
  plant.rate_hz = rig.rate_hz;
  plant.sweep = rig.sweep;
  plant.system = sim::read_plant(rig.file->section("plant"));
  plant.modes = modal_form(plant.system);
  return plant;
}

const char* to_string(Noise noise) {
  switch (noise) {
    case Noise::n80: return "N80";
    case Noise::n60: return "N60";
    case Noise::l20: return "L20";
  }
  return "";
}

sim::SimulatedRigSettings QualityCase::rig(std::uint64_t seed) const {
  sim::SimulatedRigSettings settings;
  settings.system = plant.system;
  settings.sensors.resize(1);
  settings.sensors[0].imperfections.noise_rms = noise_rms;
  settings.seed = seed;
  return settings;
}

QualityCase make_case(const QualityPlant& plant, Noise noise) {
  QualityCase result{.plant = plant, .plan = {}};
  SweepSettings sweep = plant.sweep;
  if (noise == Noise::l20) {
    result.noise_rms = 1.0;
    const double amplitude = std::numbers::sqrt2 * 10.0;  // 20 dB above a noise of one
    for (const double hz : asked_frequencies(sweep)) {
      sweep.amplitude_table.push_back({hz, amplitude / std::abs(plant.response(hz))});
    }
  } else {
    const double below = noise == Noise::n80 ? 1e-4 : 1e-3;
    result.noise_rms = sweep.amplitude * peak_gain(plant) / std::numbers::sqrt2 * below;
  }
  result.plan = plan_sweep(sweep, {}, plant.rate_hz);
  return result;
}

ResponseError error_of(std::complex<double> measured, std::complex<double> truth) {
  const std::complex<double> ratio = measured / truth;
  return {.gain_db = std::abs(20.0 * std::log10(std::abs(ratio))),
          .phase_deg = std::abs(std::arg(ratio)) * 360.0 / two_pi};
}

}  // namespace sinerig::quality
