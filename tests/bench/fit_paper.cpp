#include <cmath>
#include <cstdio>
#include <functional>
#include <random>

#include "fit_cases.h"
#include "identify/choe.h"
#include "identify/hassul.h"

namespace sinerig::bench {

namespace {

using namespace identify;
using namespace identify::test;
using Random = std::mt19937_64;
using Method = std::function<TransferFunction(const Response&, const HassulOrders&)>;

// Eq. (16) of the paper, s in rad/s.
const TransferFunction weight_of_the_paper{{609.2, 6331.7}, {1.0, 15.67, 264.7, 837.37}, 0.0};

TransferFunction unweighted(const Response& response, const HassulOrders& orders) {
  return fit_hassul(response, orders, unit_weights(response));
}
TransferFunction inverse_frequency(const Response& response, const HassulOrders& orders) {
  return fit_hassul(response, orders, inverse_frequency_weights(response));
}
TransferFunction equation_16(const Response& response, const HassulOrders& orders) {
  return fit_hassul(response, orders, weights_from(weight_of_the_paper, response));
}
TransferFunction choe(const Response& response, const HassulOrders& orders) {
  return fit_choe(response, orders).model;
}
TransferFunction likelihood(const Response& response, const HassulOrders& orders) {
  FitOptions options;
  options.zeros = orders.m;
  options.poles = orders.n + orders.k;
  options.origin = orders.k;
  return fit_maximum_likelihood(response, options).model;
}

std::vector<double> all_rms(const TransferFunction& plant, const HassulOrders& orders,
                            const Method& method, double sigma, int runs, std::uint64_t seed) {
  Random random(seed);
  std::vector<double> rms_db;
  for (int run = 0; run < runs; ++run) {
    const Response response = noisy_response(plant, choe_grid(), sigma, random);
    rms_db.push_back(gain_error(method(response, orders), plant, choe_grid()).rms_db);
  }
  return rms_db;
}

double median_rms(const TransferFunction& plant, const HassulOrders& orders, const Method& method,
                  double sigma, int runs, std::uint64_t seed) {
  return quantile(all_rms(plant, orders, method, sigma, runs, seed), 0.5);
}

ZerosPolesGain damped_plant(int n, int m, int k) {
  ZerosPolesGain plant;
  const auto place = [](std::vector<std::complex<double>>& roots, int count, double shift) {
    for (int i = 0; i + 1 < count; i += 2)
      add_pair(roots, shift * std::pow(10.0, (i + 0.5) / 7.0 - 0.5), 0.3);
    if (count % 2 == 1) add_real(roots, shift * 2.0);
  };
  place(plant.poles, n, 1.0);
  place(plant.zeros, m, 1.4);
  set_static_gain(plant, 3.0);
  for (int i = 0; i < std::abs(k); ++i) (k > 0 ? plant.poles : plant.zeros).push_back(0.0);
  return plant;
}

double worst_coefficient_error(int k) {
  double worst = 0.0;
  for (int n = 1; n <= 7; ++n)
    for (int m = 0; m < n; ++m) {
      const TransferFunction truth = to_transfer_function(damped_plant(n, m, k));
      const Response response = exact_response(truth, log_grid(1.0, 40.0, 60));
      const TransferFunction model = inverse_frequency(response, {n, m, k});
      const double common = model.den[0];
      const auto compare = [&](const std::vector<double>& a, const std::vector<double>& b) {
        for (std::size_t i = 0; i < a.size(); ++i)
          if (b[i] != 0.0) worst = std::max(worst, std::abs(a[i] / common / b[i] - 1.0));
      };
      compare(model.num, truth.num);
      compare(model.den, truth.den);
    }
  return worst;
}

// Plants of the shape of the paper's first two figures; its data exist only as pictures.
TransferFunction like_example_1() {
  return {{1.2e6}, polynomial_from_roots({-20.0, {-60.0, 120.0}, {-60.0, -120.0}}), 0.0};
}
ZerosPolesGain like_example_2() {
  return damped_plant(7, 6, 0);
}

}  // namespace

void bench_paper(FitBench& bench) {
  Table& table = bench.table;
  table.section("Hassul, exact data, n/m from 1/0 to 7/6: worst relative error of a coefficient");
  for (const int k : {-1, 0, 1, 2})
    table.at_most("k = " + std::to_string(k), worst_coefficient_error(k), 1e-9, "");

  table.section("Examples 1 and 2: plants of the shape of the paper's figures, 0.1 %, median rms");
  const std::vector<std::pair<std::string, Method>> methods{
      {"unweighted", unweighted}, {"1/w", inverse_frequency}, {"Choe", choe}, {"ml", likelihood}};
  for (const auto& [name, method] : methods) {
    table.figure("1 (3/0): " + name,
                 median_rms(like_example_1(), {3, 0, 0}, method, 0.001, bench.runs, bench.seed),
                 "dB");
    table.figure("2 (7/6): " + name,
                 median_rms(to_transfer_function(like_example_2()), {7, 6, 0}, method, 0.001,
                            bench.runs, bench.seed),
                 "dB");
  }

  struct Row {
    std::string name;
    Method method;
    double published_db[3];  // medians of 200 runs at 0.1, 1 and 3 %
  };
  const Row rows[] = {{"unweighted", unweighted, {0.228, 2.33, 5.0}},
                      {"1/w", inverse_frequency, {0.0075, 0.076, 0.23}},
                      {"eq. (16), rad/s", equation_16, {0.0030, 0.030, 0.091}},
                      {"Choe", choe, {0.0021, 0.024, 0.066}}};
  const double sigmas[] = {0.001, 0.01, 0.03};
  table.section("Example 3 (347), median rms; the reference within 10 %, its own chance beside");
  table.note(
      "The reference is a median of 200 runs; such medians lie in the brackets in 95 of 100");
  table.note("cases (order statistics of the runs here).");
  for (const Row& row : rows)
    for (int i = 0; i < 3; ++i) {
      const auto rms_db =
          all_rms(choe_example_3(), {3, 0, 0}, row.method, sigmas[i], 25 * bench.runs, bench.seed);
      const double reference = row.published_db[i];
      // Half of 200 runs, give or take 1.96·sqrt(200)/2.
      const double low = quantile(rms_db, 0.431);
      const double high = quantile(rms_db, 0.569);
      char name[96];
      std::snprintf(name, sizeof name, "%s at %g %% [%.4g to %.4g]", row.name.c_str(),
                    100.0 * sigmas[i], low, high);
      const double median = quantile(rms_db, 0.5);
      table.within(name, median, 0.9 * reference, 1.1 * reference, "dB");
    }
  table.at_most("Choe at 1 %",
                median_rms(choe_example_3(), {3, 0, 0}, choe, 0.01, 5 * bench.runs, bench.seed),
                0.03, "dB");
  table.section("Example 3 with 94.7 in place of 347, 1 %, median rms");
  table.note(
      "347 puts a pole at 322 rad/s; with 94.7 the filter is a 0.55 dB Chebyshev of 12.2 Hz,");
  table.note(
      "and the roots of eq. (16) stand at its corner: the printed 347 is probably a misprint.");
  for (const auto& [name, method] : methods)
    table.figure(name,
                 median_rms(choe_example_3(94.7), {3, 0, 0}, method, 0.01, bench.runs, bench.seed),
                 "dB");
}

}  // namespace sinerig::bench
