#include <cmath>
#include <random>

#include "fit_cases.h"
#include "identify/hold.h"

namespace sinerig::bench {

namespace {

using namespace identify;
using namespace identify::test;
using Random = std::mt19937_64;

// Measured through a hold at rate_hz and a path of path_delay_s.
Response held(const ZerosPolesGain& plant, const std::vector<double>& grid, double rate_hz,
              double path_delay_s, double sigma, Random& random) {
  ZerosPolesGain with_path = plant;
  with_path.delay_s += path_delay_s;
  const Eigen::ArrayXd omega =
      Eigen::Map<const Eigen::ArrayXd>(grid.data(), static_cast<Eigen::Index>(grid.size()));
  const Eigen::ArrayXcd H = held_response(with_path, 1.0 / rate_hz, omega);
  std::normal_distribution<double> normal(0.0, sigma);
  Response response;
  for (Eigen::Index i = 0; i < H.size(); ++i) {
    const double gain = 1.0 + normal(random);
    const std::complex<double> measured = H[i] * gain * std::polar(1.0, normal(random));
    response.push_back(point_with_relative_scatter(omega[i], measured, sigma));
  }
  return response;
}

}  // namespace

void bench_hold(FitBench& bench) {
  Random random(bench.seed);
  for (const double rate_hz : {1000.0, 2000.0, 10000.0}) {
    const std::string rate = std::to_string(static_cast<int>(rate_hz));
    bench.table.section("Continuous gimbal b through a hold at " + rate +
                        " Hz and a path of 0.7 ms; grid to 300 Hz");
    FitOptions options = options_for(gimbal_b(), Delay::fit);
    options.hold_period_s = 1.0 / rate_hz;
    options.path_delay_s = 0.7e-3;
    const Response exact = held(gimbal_b(), gimbal_grid(), rate_hz, 0.7e-3, 1e-9, random);
    const Fit fit = fit_maximum_likelihood(exact, options);
    bench.table.at_most("exact data: largest gain error",
                        gain_error(fit.zpk, gimbal_b(), gimbal_grid()).max_db, 1e-5, "dB");
    std::vector<double> ratio;
    double delay_variance = 0.0;
    const int runs = bench.runs / 4;
    for (int run = 0; run < runs; ++run) {
      const Response noisy = held(gimbal_b(), gimbal_grid(), rate_hz, 0.7e-3, 0.01, random);
      const Fit noisy_fit = fit_maximum_likelihood(noisy, options);
      ratio.push_back(gain_error(noisy_fit.zpk, gimbal_b(), gimbal_grid()).rms_db /
                      crlb_db(0.01, noisy_fit.free_parameters, 100));
      delay_variance += std::pow(noisy_fit.zpk.delay_s - 1.5e-3, 2) / runs;
    }
    bench.table.at_most("1 %: rms gain error / CRLB, median", quantile(ratio, 0.5), 1.1, "");
    bench.table.at_most("1 %: rms gain error / CRLB, largest", quantile(ratio, 1.0), 2.0, "");
    bench.table.at_most("1 %: delay, standard deviation", 1e6 * std::sqrt(delay_variance), 20,
                        "us");
  }
}

}  // namespace sinerig::bench
