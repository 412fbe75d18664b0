#include <cmath>
#include <cstdlib>
#include <random>
#include <vector>

#include <Eigen/QR>

#include "fit_cases.h"
#include "identify/root_covariance.h"

namespace sinerig::bench {

namespace {

using namespace identify;
using namespace identify::test;
using Random = std::mt19937_64;

struct Outcome {
  std::vector<double> rms_db, ratio, delay_error_s;
  int within_two = 0;
  double max_db = 0.0;
  int runs() const { return static_cast<int>(ratio.size()); }
  double percent_within_two() const { return 100.0 * within_two / runs(); }
};

void run_once(Outcome& outcome, const ZerosPolesGain& plant, const std::vector<double>& grid,
              const Response& response, const FitOptions& options, double sigma) {
  const Fit fit = fit_maximum_likelihood(response, options);
  const GainError error = gain_error(fit.zpk, plant, grid);
  const double ratio = error.rms_db / crlb_db(sigma, fit.free_parameters, grid.size());
  outcome.rms_db.push_back(error.rms_db);
  outcome.ratio.push_back(ratio);
  outcome.delay_error_s.push_back(fit.zpk.delay_s - plant.delay_s);
  outcome.within_two += ratio <= 2.0 ? 1 : 0;
  outcome.max_db = std::max(outcome.max_db, error.max_db);
}

Outcome random_gimbals(std::uint64_t seed, int runs, double sigma, int points, Delay delay) {
  Random random(seed);
  Outcome outcome;
  const auto grid = gimbal_grid(points);
  for (int run = 0; run < runs; ++run) {
    const RandomGimbal<Random> gimbal(random);
    const Response response = noisy_response(gimbal.plant, grid, sigma, random);
    run_once(outcome, gimbal.plant, grid, response, options_for(gimbal.plant, delay), sigma);
  }
  return outcome;
}

// The error of an estimate that is efficient by construction: least squares on the model linearised
// at the true plant, on the same noise. What is left above the CRLB in its 95 % is chance.
double efficient_rms_db(const ZerosPolesGain& plant, const Response& response, double sigma) {
  const auto g = static_cast<Eigen::Index>(response.size());
  const double reference = plant.poles.empty() ? 1.0 : std::abs(plant.poles.front());
  const Eigen::Index coordinates = coordinates_of(plant) - 1;  // the delay is known
  Eigen::MatrixXd J(2 * g, coordinates);
  for (Eigen::Index k = 0; k < coordinates; ++k) {
    constexpr double width = 1e-6;
    Eigen::VectorXd step = Eigen::VectorXd::Zero(coordinates + 1);
    step[k] = k + 1 == coordinates ? width : width * reference;
    const ZerosPolesGain ahead = moved(plant, reference, step);
    const ZerosPolesGain behind = moved(plant, reference, -step);
    for (Eigen::Index i = 0; i < g; ++i) {
      const double omega = response[static_cast<std::size_t>(i)].omega_rad_s;
      const std::complex<double> slope =
          (ahead.at(omega) - behind.at(omega)) / (2.0 * step[k] * plant.at(omega));
      J(i, k) = slope.real();
      J(g + i, k) = slope.imag();
    }
  }
  Eigen::VectorXd noise(2 * g);
  for (Eigen::Index i = 0; i < g; ++i) {
    const ResponsePoint& point = response[static_cast<std::size_t>(i)];
    const std::complex<double> relative = point.response / plant.at(point.omega_rad_s) - 1.0;
    noise[i] = relative.real() / sigma;
    noise[g + i] = relative.imag() / sigma;
  }
  const Eigen::VectorXd size = J.colwise().norm();
  const Eigen::MatrixXd scaled = J * size.cwiseInverse().asDiagonal();
  const Eigen::VectorXd error = scaled * scaled.colPivHouseholderQr().solve(noise);
  return 20.0 / std::numbers::ln10 * sigma * error.head(g).norm() /
         std::sqrt(static_cast<double>(g));
}

void add_gross_outliers(Response& response, int count, Random& random) {
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<std::size_t> hit;
  while (static_cast<int>(hit.size()) < count) {
    const auto i = std::uniform_int_distribution<std::size_t>(0, response.size() - 1)(random);
    if (std::find(hit.begin(), hit.end(), i) != hit.end()) continue;
    hit.push_back(i);
    const double factor = std::exp((uniform(random) < 0.5 ? 1.0 : -1.0) * (0.4 + uniform(random)));
    response[i].response *= std::polar(factor, 2.0 * (uniform(random) - 0.5));
  }
}

}  // namespace

void bench_likelihood(FitBench& bench) {
  Table& table = bench.table;
  Random random(bench.seed);

  table.section("Maximum likelihood: example 3 at 1 %");
  const ZerosPolesGain example = to_zeros_poles_gain(choe_example_3());
  Outcome a;
  // A median of 1000 runs still scatters by 1.4 %.
  for (int run = 0; run < 50 * bench.runs; ++run) {
    const Response response = noisy_response(example, choe_grid(), 0.01, random);
    run_once(a, example, choe_grid(), response, options_for(example, Delay::none), 0.01);
  }
  const double bound_a = crlb_db(0.01, 4, 60);
  table.at_most("rms gain error, median [CRLB 0.0159 dB]", quantile(a.rms_db, 0.5), 1.05 * bound_a,
                "dB");
  table.at_most("rms gain error, 95 %", quantile(a.rms_db, 0.95), 0.08, "dB");

  table.section("Gimbal b at 1 %, delay of 1.5 ms unknown");
  Outcome b;
  for (int run = 0; run < bench.runs; ++run) {
    const Response response = noisy_response(gimbal_b(), gimbal_grid(), 0.01, random);
    run_once(b, gimbal_b(), gimbal_grid(), response, options_for(gimbal_b(), Delay::fit), 0.01);
  }
  double variance = 0.0;
  for (const double error : b.delay_error_s) variance += error * error / b.runs();
  table.at_most("rms gain error, median [CRLB 0.0213 dB]", quantile(b.rms_db, 0.5), 0.0225, "dB");
  table.at_most("rms gain error, largest", quantile(b.rms_db, 1.0), 0.1, "dB");
  table.at_most("delay, standard deviation", 1e6 * std::sqrt(variance), 3.0, "us");

  table.section("Random gimbals, delay unknown; ratio = rms gain error / CRLB");
  for (const auto& [sigma, goal] :
       {std::pair{0.01, 99.5}, {0.001, 99.0}, {0.03, 99.0}, {0.05, 99.0}}) {
    const Outcome r = random_gimbals(bench.seed, 5 * bench.runs, sigma, 100, Delay::fit);
    const std::string at = std::to_string(sigma * 100.0).substr(0, 3) + " %: ";
    table.at_least(at + "within 2 x CRLB", r.percent_within_two(), goal, "%");
    if (sigma == 0.01)
      table.at_most(at + "median ratio", quantile(r.ratio, 0.5), 1.05, "");
    else
      table.figure(at + "median ratio", quantile(r.ratio, 0.5), "");
  }
  const Outcome half = random_gimbals(bench.seed, bench.runs, 0.01, 50, Delay::fit);
  table.figure("1 %, 50 points: within 2 x CRLB", half.percent_within_two(), "%");

  table.section("Modes over four decades, 400 points, 1 %");
  Outcome all;
  std::vector<double> efficient;
  for (const int order : {8, 12, 18, 26}) {
    Outcome wide;
    for (int run = 0; run < bench.runs; ++run) {
      const ZerosPolesGain plant = wide_plant(order / 2, random);
      const Response response = noisy_response(plant, wide_grid(), 0.01, random);
      for (Outcome* outcome : {&wide, &all})
        run_once(*outcome, plant, wide_grid(), response, options_for(plant, Delay::none), 0.01);
      const int parameters = static_cast<int>(plant.poles.size() + plant.zeros.size()) + 1;
      efficient.push_back(efficient_rms_db(plant, response, 0.01) /
                          crlb_db(0.01, parameters, response.size()));
    }
    const std::string at = "order " + std::to_string(order) + ": ";
    table.at_least(at + "within 2 x CRLB", wide.percent_within_two(), 100.0, "%");
    table.figure(at + "ratio, 95 %", quantile(wide.ratio, 0.95), "");
  }
  const double by_chance = quantile(efficient, 0.95);
  table.figure("all orders: ratio, 95 %, of an efficient estimate by construction", by_chance, "");
  table.at_most("all orders: ratio, 95 %", quantile(all.ratio, 0.95), 1.25, "");

  table.section("Exact data: largest gain error");
  for (const int order : {8, 12, 18, 26}) {
    Outcome exact;
    for (int run = 0; run < 5; ++run) {
      const ZerosPolesGain plant = wide_plant(order / 2, random);
      run_once(exact, plant, wide_grid(), exact_response(plant, wide_grid()),
               options_for(plant, Delay::none), 1.0);
    }
    table.at_most("order " + std::to_string(order), exact.max_db, 1e-11, "dB");
  }

  table.section("3 of 100 points gross outliers, gimbal b and random gimbals, 1 %, delay unknown");
  Outcome with_outliers;
  for (int run = 0; run < 5 * bench.runs; ++run) {
    const RandomGimbal<Random> gimbal(random);
    const ZerosPolesGain plant = run % 2 == 0 ? gimbal_b() : gimbal.plant;
    Response response = noisy_response(plant, gimbal_grid(), 0.01, random);
    add_gross_outliers(response, 3, random);
    run_once(with_outliers, plant, gimbal_grid(), response, options_for(plant, Delay::fit), 0.01);
  }
  table.at_least("within 2 x CRLB", with_outliers.percent_within_two(), 95.0, "%");
}

}  // namespace sinerig::bench
