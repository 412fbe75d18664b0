#include <cmath>
#include <random>

#include "fit_cases.h"

namespace sinerig::bench {

namespace {

using namespace identify;
using namespace identify::test;
using Random = std::mt19937_64;

struct Coverage {
  int inside = 0;
  int total = 0;
  void add(double error, double standard_error) {
    inside += std::abs(error) <= 1.959964 * standard_error ? 1 : 0;
    ++total;
  }
  double percent() const { return 100.0 * inside / std::max(total, 1); }
};

struct Coverages {
  Coverage pole, damping, delay, gain, response;
};

double true_static_gain(const ZerosPolesGain& plant) {
  double gain = plant.gain;
  for (const auto zero : plant.zeros) gain *= std::abs(zero);
  for (const auto pole : plant.poles)
    if (pole != 0.0) gain /= std::abs(pole);
  return gain;
}

void cover(Coverages& coverages, const ZerosPolesGain& plant, const Fit& fit) {
  for (const Mode& mode : fit.modes) {
    if (mode.pole.imag() == 0.0) continue;
    std::complex<double> nearest = plant.poles.front();
    for (const auto pole : plant.poles)
      if (std::abs(pole - mode.pole) < std::abs(nearest - mode.pole)) nearest = pole;
    const double omega = std::abs(nearest);
    coverages.pole.add(mode.frequency_hz.value - omega / (2.0 * std::numbers::pi),
                       mode.frequency_hz.standard_error);
    coverages.damping.add(mode.damping.value + nearest.real() / omega, mode.damping.standard_error);
  }
  coverages.delay.add(fit.delay_s.value - plant.delay_s, fit.delay_s.standard_error);
  coverages.gain.add(fit.static_gain.value - true_static_gain(plant),
                     fit.static_gain.standard_error);
  for (const double omega : {1.0, 30.0, 200.0, 1000.0}) {
    const ResponsePoint band = fit.response(omega);
    const std::complex<double> error = band.response - plant.at(omega);
    coverages.response.add(error.real(), std::sqrt(band.variance_re));
    coverages.response.add(error.imag(), std::sqrt(band.variance_im));
  }
}

void report(Table& table, const Coverages& c) {
  table.within("frequency of the modes", c.pole.percent(), 93.0, 97.0, "%");
  table.within("damping of the modes", c.damping.percent(), 93.0, 97.0, "%");
  table.within("delay", c.delay.percent(), 93.0, 97.0, "%");
  table.within("static gain", c.gain.percent(), 93.0, 97.0, "%");
  table.within("band of the response (re, im at four frequencies)", c.response.percent(), 93.0,
               97.0, "%");
}

}  // namespace

void bench_intervals(FitBench& bench) {
  Random random(bench.seed);
  bench.table.section("95 % intervals cover the truth: gimbal b, 1 %, delay unknown");
  Coverages of_b;
  for (int run = 0; run < 5 * bench.runs; ++run) {
    const Response response = noisy_response(gimbal_b(), gimbal_grid(), 0.01, random);
    cover(of_b, gimbal_b(), fit_maximum_likelihood(response, options_for(gimbal_b(), Delay::fit)));
  }
  report(bench.table, of_b);
  bench.table.section("95 % intervals cover the truth: random gimbals, 1 %, delay unknown");
  Coverages of_random;
  for (int run = 0; run < 5 * bench.runs; ++run) {
    const RandomGimbal<Random> gimbal(random);
    const Response response = noisy_response(gimbal.plant, gimbal_grid(), 0.01, random);
    cover(of_random, gimbal.plant,
          fit_maximum_likelihood(response, options_for(gimbal.plant, Delay::fit)));
  }
  report(bench.table, of_random);
}

}  // namespace sinerig::bench
