#include <random>

#include <Eigen/QR>

#include "fit_cases.h"
#include "identify/order.h"

namespace sinerig::bench {

namespace {

using namespace identify;
using namespace identify::test;
using Random = std::mt19937_64;

// The yardstick that makes times comparable between machines: Householder QR of 200 × 14 doubles.
double kernel_ms() {
  const Eigen::MatrixXd A = Eigen::MatrixXd::Random(200, 14);
  std::vector<double> times;
  for (int i = 0; i < 500; ++i) {
    const auto start = std::chrono::steady_clock::now();
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(A);
    times.push_back(milliseconds_since(start) + 0.0 * qr.matrixQR()(0, 0));
  }
  return quantile(times, 0.5);
}

template <typename Make>
double median_ms(int repeats, const Make& make, Delay delay, Random& random) {
  std::vector<double> times;
  for (int i = 0; i < repeats; ++i) {
    const auto [plant, grid] = make();
    const Response response = noisy_response(plant, grid, 0.01, random);
    const auto start = std::chrono::steady_clock::now();
    const Fit fit = fit_maximum_likelihood(response, options_for(plant, delay));
    times.push_back(milliseconds_since(start) + 0.0 * fit.chi2);
  }
  return quantile(times, 0.5);
}

// Every start tried, none left out because an earlier one has already explained the data: a scatter
// said to be a thousandth of what it is leaves nothing explained.
double all_starts_ms(int repeats, Random& random) {
  std::vector<double> times;
  for (int i = 0; i < repeats; ++i) {
    const ZerosPolesGain plant = wide_plant(13, random);
    Response response = noisy_response(plant, wide_grid(), 0.01, random);
    for (ResponsePoint& point : response) {
      point.variance_re *= 1e-6;
      point.variance_im *= 1e-6;
    }
    FitOptions options = options_for(plant, Delay::none);
    options.robust = false;
    const auto start = std::chrono::steady_clock::now();
    const Fit fit = fit_maximum_likelihood(response, options);
    times.push_back(milliseconds_since(start) + 0.0 * fit.chi2);
  }
  return quantile(times, 0.5);
}

double sweep_ms(int repeats, Random& random) {
  std::vector<double> times;
  for (int i = 0; i < repeats; ++i) {
    const Response response = noisy_response(gimbal_b(), gimbal_grid(), 0.01, random);
    OrderSettings settings;
    settings.fit.delay = Delay::fit;
    const auto start = std::chrono::steady_clock::now();
    const OrderSelection selection = select_order(response, settings);
    times.push_back(milliseconds_since(start) + 0.0 * selection.fit.chi2);
  }
  return quantile(times, 0.5);
}

}  // namespace

void bench_speed(FitBench& bench) {
  Random random(bench.seed);
  Table& table = bench.table;
  table.section("Time of one fit, median, for one quiet core; in brackets in QRs of 200 x 14");
  const double kernel = kernel_ms();
  table.figure("the QR kernel", 1e3 * kernel, "us");
  const auto row = [&](const std::string& name, double time_ms, double bound_ms) {
    table.at_most(name + " [" + std::to_string(static_cast<int>(time_ms / kernel)) + " QR]",
                  time_ms, bound_ms, "ms");
  };
  using Case = std::pair<ZerosPolesGain, std::vector<double>>;
  const auto example = [] {
    return Case{to_zeros_poles_gain(choe_example_3()), choe_grid()};
  };
  const auto gimbal = [] {
    return Case{gimbal_b(), gimbal_grid()};
  };
  const auto wide = [&] {
    return Case{wide_plant(13, random), wide_grid()};
  };
  row("example 3, 60 points", median_ms(200, example, Delay::none, random), 0.3);
  row("gimbal b, 100 points, delay known", median_ms(100, gimbal, Delay::known, random), 1.5);
  row("gimbal b, 100 points, delay estimated", median_ms(100, gimbal, Delay::fit, random), 12.0);
  row("order 26, 400 points", median_ms(15, wide, Delay::none, random), 60.0);
  row("order 26, 400 points, all starts", all_starts_ms(5, random), 1000.0);
  row("gimbal b, orders and structures swept", sweep_ms(20, random), 300.0);
}

}  // namespace sinerig::bench
