#include <cmath>
#include <random>

#include "fit_cases.h"
#include "identify/order.h"

namespace sinerig::bench {

namespace {

using namespace identify;
using namespace identify::test;
using Random = std::mt19937_64;

struct Tally {
  int exact = 0;
  int runs = 0;
  double worst_ratio = 0.0;
  double worst_ratio_of_wrong = 0.0;
  std::vector<double> time_ms;
};

void choose_once(Tally& tally, const ZerosPolesGain& plant, const std::vector<double>& grid,
                 Delay delay, Random& random) {
  const Response response = noisy_response(plant, grid, 0.01, random);
  OrderSettings settings;
  settings.fit.delay = delay;
  const auto start = std::chrono::steady_clock::now();
  const OrderSelection selection = select_order(response, settings);
  tally.time_ms.push_back(milliseconds_since(start));
  const FitOptions truth = options_for(plant, delay);
  const FitOptions& chosen = selection.chosen;
  const bool exact = chosen.poles == truth.poles && chosen.zeros == truth.zeros;
  tally.exact += exact ? 1 : 0;
  ++tally.runs;
  const int parameters =
      truth.zeros + truth.poles - truth.origin + 1 + (delay == Delay::fit ? 1 : 0);
  const double ratio =
      gain_error(selection.fit.zpk, plant, grid).rms_db / crlb_db(0.01, parameters, grid.size());
  tally.worst_ratio = std::max(tally.worst_ratio, ratio);
  if (!exact) tally.worst_ratio_of_wrong = std::max(tally.worst_ratio_of_wrong, ratio);
  if (!exact || ratio > 2.0)
    std::printf("  truth %d/%d k %d: chose %d/%d k %d, %.2f x CRLB, %zu points left out\n",
                truth.poles, truth.zeros, truth.origin, chosen.poles, chosen.zeros, chosen.origin,
                ratio, selection.fit.outliers.size());
}

void report(Table& table, const Tally& tally) {
  table.at_least("(poles, zeros) exact", 100.0 * tally.exact / tally.runs, 95.0, "%");
  table.at_most("another order: worst rms gain error / CRLB of the true one",
                tally.worst_ratio_of_wrong, 2.0, "");
  table.figure("any order: worst ratio (4 parameters scatter beyond 2)", tally.worst_ratio, "");
  table.at_most("time of the whole sweep, median", quantile(tally.time_ms, 0.5), 300.0, "ms");
  table.figure("time of the whole sweep, 95 %", quantile(tally.time_ms, 0.95), "ms");
}

}  // namespace

void bench_order(FitBench& bench) {
  Random random(bench.seed);
  const int runs = std::max(bench.runs / 2, 10);
  bench.table.section("Order and structure chosen: example 3 (3/0), 1 %");
  Tally example;
  for (int run = 0; run < runs; ++run)
    choose_once(example, to_zeros_poles_gain(choe_example_3()), choe_grid(), Delay::none, random);
  report(bench.table, example);
  bench.table.section("Order and structure chosen: gimbal b (7/4), delay unknown, 1 %");
  Tally b;
  for (int run = 0; run < runs; ++run)
    choose_once(b, gimbal_b(), gimbal_grid(), Delay::fit, random);
  report(bench.table, b);
  bench.table.section("Order and structure chosen: random gimbals, delay unknown, 1 %");
  Tally gimbals;
  for (int run = 0; run < runs; ++run)
    choose_once(gimbals, RandomGimbal<Random>(random).plant, gimbal_grid(), Delay::fit, random);
  report(bench.table, gimbals);
}

}  // namespace sinerig::bench
