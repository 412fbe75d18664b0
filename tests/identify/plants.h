// Plants and noise that the tests and the benchmark of identification share.
#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdint>
#include <numbers>
#include <random>
#include <vector>

#include "identify/hold.h"
#include "identify/response.h"
#include "identify/transfer_function.h"

namespace sinerig::identify::test {

inline std::vector<double> log_grid(double first, double last, int points) {
  std::vector<double> grid;
  for (int i = 0; i < points; ++i)
    grid.push_back(first * std::pow(last / first, static_cast<double>(i) / (points - 1)));
  return grid;
}

// Example 3 of Choe's paper; the published 347 beside 94.7, with which it is a Chebyshev filter of
// 0.55 dB ripple.
inline TransferFunction choe_example_3(double b2 = 347.0) {
  return {{309673.0}, {1.0, b2, 8987.0, 317356.0}, 0.0};
}
inline std::vector<double> choe_grid() {
  return log_grid(1.0, 1000.0, 60);
}

template <typename Model>
Response exact_response(const Model& plant, const std::vector<double>& omega_rad_s) {
  Response response;
  for (const double omega : omega_rad_s) response.push_back({omega, plant.at(omega), 0, 0, 0});
  return response;
}

// Independent N(0, sigma) on the relative gain and on the phase in rad; the scatter is filled in.
template <typename Model, typename Random>
Response noisy_response(const Model& plant, const std::vector<double>& omega_rad_s, double sigma,
                        Random& random) {
  std::normal_distribution<double> normal(0.0, sigma);
  Response response;
  for (const double omega : omega_rad_s) {
    const double gain = 1.0 + normal(random);
    const double phase = normal(random);
    const std::complex<double> measured = plant.at(omega) * gain * std::polar(1.0, phase);
    response.push_back(point_with_relative_scatter(omega, measured, sigma));
  }
  return response;
}

// The same of the real and the imaginary part, measured behind a zero-order hold.
template <typename Random>
Response noisy_behind_hold(const ZerosPolesGain& plant, double period_s,
                           const std::vector<double>& omega_rad_s, double sigma, Random& random) {
  std::normal_distribution<double> normal(0.0, sigma);
  const Eigen::ArrayXcd held =
      held_response(plant, period_s,
                    Eigen::Map<const Eigen::ArrayXd>(
                        omega_rad_s.data(), static_cast<Eigen::Index>(omega_rad_s.size())));
  Response response;
  for (std::size_t i = 0; i < omega_rad_s.size(); ++i) {
    const double re = normal(random);
    const double im = normal(random);
    response.push_back(point_with_relative_scatter(
        omega_rad_s[i], held[static_cast<Eigen::Index>(i)] * std::complex<double>(1.0 + re, im),
        sigma));
  }
  return response;
}

inline void add_pair(std::vector<std::complex<double>>& roots, double frequency_hz,
                     double damping) {
  const double omega = 2.0 * std::numbers::pi * frequency_hz;
  const std::complex<double> root{-damping * omega, omega * std::sqrt(1.0 - damping * damping)};
  roots.push_back(root);
  roots.push_back(std::conj(root));
}

inline void add_real(std::vector<std::complex<double>>& roots, double frequency_hz) {
  roots.emplace_back(-2.0 * std::numbers::pi * frequency_hz);
}

// zpk.gain such that s^k·G at s = 0 is static_gain.
inline void set_static_gain(ZerosPolesGain& zpk, double static_gain) {
  zpk.gain = static_gain;
  for (const auto pole : zpk.poles)
    if (pole != 0.0) zpk.gain *= std::abs(pole);
  for (const auto zero : zpk.zeros)
    if (zero != 0.0) zpk.gain /= std::abs(zero);
}

// Gimbal b: one pole at the origin, n = 7, m = 4, delay 1.5 ms.
inline ZerosPolesGain gimbal_b() {
  ZerosPolesGain plant{{}, {0.0}, 1.0, 1.5e-3};
  add_pair(plant.zeros, 18.0, 0.01);
  add_pair(plant.zeros, 75.0, 0.01);
  add_real(plant.poles, 0.8);
  add_real(plant.poles, 150.0);
  add_pair(plant.poles, 23.0, 0.01);
  add_pair(plant.poles, 90.0, 0.01);
  set_static_gain(plant, 20.0);
  return plant;
}
inline std::vector<double> gimbal_grid(int points = 100) {
  return log_grid(2.0 * std::numbers::pi * 0.1, 2.0 * std::numbers::pi * 300.0, points);
}

// A gimbal drawn at random: 0 to 2 poles at the origin, 1 to 4 lightly damped mode pairs, two real
// poles, a delay up to 4 ms.
template <typename Random>
struct RandomGimbal {
  ZerosPolesGain plant;
  int origin = 0;
  explicit RandomGimbal(Random& random) {
    const auto uniform = [&](double a, double b) {
      return std::uniform_real_distribution<double>(a, b)(random);
    };
    const auto log_uniform = [&](double a, double b) {
      return std::exp(uniform(std::log(a), std::log(b)));
    };
    origin = std::uniform_int_distribution<int>(0, 2)(random);
    const int pairs = std::uniform_int_distribution<int>(1, 4)(random);
    plant.poles.assign(static_cast<std::size_t>(origin), 0.0);
    std::vector<double> frequencies_hz;
    while (static_cast<int>(frequencies_hz.size()) < pairs) {
      const double candidate_hz = log_uniform(5.0, 200.0);
      bool apart = true;
      for (const double other : frequencies_hz)
        apart = apart && std::abs(std::log(candidate_hz / other)) >= 0.25;
      if (apart) frequencies_hz.push_back(candidate_hz);
    }
    for (const double frequency_hz : frequencies_hz) {
      const double ratio = uniform(0.0, 1.0) < 0.6 ? uniform(0.75, 0.95) : uniform(1.05, 1.25);
      add_pair(plant.poles, frequency_hz, log_uniform(0.003, 0.05));
      add_pair(plant.zeros, frequency_hz * ratio, log_uniform(0.003, 0.05));
    }
    add_real(plant.poles, log_uniform(0.2, 5.0));
    add_real(plant.poles, uniform(50.0, 300.0));
    plant.delay_s = uniform(0.0, 4e-3);
    set_static_gain(plant, 20.0);
  }
};

// pairs resonances and antiresonances spread evenly in log frequency over 0.1 to 1000 Hz.
template <typename Random>
ZerosPolesGain wide_plant(int pairs, Random& random) {
  const auto log_uniform = [&](double a, double b) {
    return std::exp(std::uniform_real_distribution<double>(std::log(a), std::log(b))(random));
  };
  ZerosPolesGain plant;
  for (int i = 0; i < pairs; ++i) {
    const double centre_hz = 0.1 * std::pow(1e4, (i + 0.5) / pairs);
    const double frequency_hz = centre_hz * log_uniform(0.9, 1.1);
    add_pair(plant.poles, frequency_hz, log_uniform(0.005, 0.05));
    if (i > 0)
      add_pair(plant.zeros, frequency_hz * log_uniform(0.75, 0.95), log_uniform(0.005, 0.05));
  }
  set_static_gain(plant, 1.0);
  return plant;
}
inline std::vector<double> wide_grid() {
  return log_grid(2.0 * std::numbers::pi * 0.1, 2.0 * std::numbers::pi * 1000.0, 400);
}

// Of low order: their images near half the rate of a hold are as large as they are themselves.
inline std::vector<ZerosPolesGain> plain_plants() {
  constexpr double turn = 2.0 * std::numbers::pi;
  std::vector<ZerosPolesGain> plants{{{}, {0.0}, 1.0, 0.0},
                                     {{}, {-5.0 * turn}, 5.0 * turn, 0.0},
                                     {{}, {0.0, -5.0 * turn}, 500.0 * turn, 0.0},
                                     {{}, {0.0, 0.0}, 100.0, 0.0},
                                     {{}, {}, 1.0, 0.0}};
  add_pair(plants.back().poles, 40.0, 0.02);
  set_static_gain(plants.back(), 1.0);
  return plants;
}

// Gain error in dB between a model and the true plant over a grid.
struct GainError {
  double rms_db = 0.0;
  double max_db = 0.0;
};
template <typename Model, typename Plant>
GainError gain_error(const Model& model, const Plant& plant,
                     const std::vector<double>& omega_rad_s) {
  GainError error;
  for (const double omega : omega_rad_s) {
    const double db = 20.0 * std::log10(std::abs(model.at(omega) / plant.at(omega)));
    error.rms_db += db * db;
    error.max_db = std::max(error.max_db, std::abs(db));
  }
  error.rms_db = std::sqrt(error.rms_db / static_cast<double>(omega_rad_s.size()));
  return error;
}

// CRLB_dB = 8.686·σ·sqrt(p/2g) for p free parameters and g points.
inline double crlb_db(double sigma, int parameters, std::size_t points) {
  return 20.0 / std::numbers::ln10 * sigma *
         std::sqrt(parameters / (2.0 * static_cast<double>(points)));
}

template <typename Value>
Value quantile(std::vector<Value> values, double fraction) {
  const auto at = static_cast<std::size_t>(fraction * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(at), values.end());
  return values[at];
}

}  // namespace sinerig::identify::test
