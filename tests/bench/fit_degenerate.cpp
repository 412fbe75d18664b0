#include <cmath>
#include <random>
#include <stdexcept>

#include "fit_cases.h"
#include "identify/order.h"

namespace sinerig::bench {

namespace {

using namespace identify;
using namespace identify::test;
using Random = std::mt19937_64;

struct Case {
  Response response;
  FitOptions options;
  ZerosPolesGain plant;
  bool answer_known = false;  // exact data of the very structure asked for
};

// Anything from two points to a wild response: gains 1e-12 to 1e12, 1e-6 to 1e6 Hz, double poles,
// poles on the grid (but for 1e-9: at 1e-12 rounding of the frequency alone is 1e-4), all-pass,
// pure gain, pure delay, orders that do not fit.
Case random_case(Random& random) {
  const auto uniform = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  const auto integer = [&](int a, int b) {
    return std::uniform_int_distribution<int>(a, b)(random);
  };
  Case c;
  const double centre = std::pow(10.0, uniform(-6.0, 6.0));
  const double decades = uniform(0.01, 4.0);
  const auto grid = log_grid(centre * std::pow(10.0, -decades / 2),
                             centre * std::pow(10.0, decades / 2), integer(2, 40));
  const int kind = integer(0, 7);
  const auto near_pair = [&](std::vector<std::complex<double>>& roots, double damping) {
    add_pair(roots, centre * uniform(0.5, 2.0) / (2.0 * std::numbers::pi), damping);
  };
  if (kind == 1) c.plant.delay_s = uniform(0.0, 3.0) / grid.back();
  if (kind == 2) c.plant = {{centre}, {-centre}, 1.0, 0.0};
  if (kind == 3) c.plant.poles.assign(2, -centre);
  if (kind == 4) {
    const std::complex<double> on_grid{-1e-9 * centre, grid[grid.size() / 2]};
    c.plant.poles = {on_grid, std::conj(on_grid)};
  }
  if (kind >= 5)
    for (int i = integer(1, 4); i > 0; --i) {
      near_pair(c.plant.poles, std::pow(10.0, uniform(-4.0, 0.0)));
      if (uniform(0.0, 1.0) < 0.7) near_pair(c.plant.zeros, std::pow(10.0, uniform(-4.0, 0.0)));
    }
  double size = 0.0;
  for (const double omega : grid) size = std::max(size, std::abs(c.plant.at(omega)));
  c.plant.gain *= std::pow(10.0, uniform(-12.0, 12.0)) / size;
  const double sigma = uniform(0.0, 1.0) < 0.5 ? 0.0 : std::pow(10.0, uniform(-6.0, 0.0));
  c.response =
      sigma > 0.0 ? noisy_response(c.plant, grid, sigma, random) : exact_response(c.plant, grid);
  c.options = options_for(c.plant, c.plant.delay_s > 0.0 ? Delay::fit : Delay::none);
  const int parameters = c.options.zeros + c.options.poles + 2;
  c.answer_known = sigma == 0.0 && 2 * static_cast<int>(grid.size()) >= 2 * parameters;
  if (uniform(0.0, 1.0) < 0.4) {
    c.answer_known = false;
    c.options.poles = integer(0, 12);
    c.options.zeros = integer(0, 12);
    c.options.origin = integer(-1, 2);
    c.options.delay = integer(0, 1) == 0 ? Delay::none : Delay::fit;
    c.options.stable = integer(0, 4) == 0;
    if (integer(0, 4) == 0) c.options.hold_period_s = uniform(0.2, 4.0) / grid.back();
  }
  if (integer(0, 30) == 0) c.response[0].response = std::nan("");
  if (integer(0, 30) == 0) c.response.back().response = 0.0;
  if (integer(0, 30) == 0) c.response.back().omega_rad_s = c.response.front().omega_rad_s;
  return c;
}

}  // namespace

void bench_degenerate(FitBench& bench) {
  const int cases = 50 * bench.runs;
  bench.table.section("Degenerate input: " + std::to_string(cases) + " random cases");
  Random random(bench.seed);
  int refused = 0;
  int not_finite = 0;
  int known = 0;
  int wrong = 0;
  double slowest_ms = 0.0;
  for (int i = 0; i < cases; ++i) {
    const Case c = random_case(random);
    const auto start = std::chrono::steady_clock::now();
    try {
      const Fit fit = fit_maximum_likelihood(c.response, c.options);
      bool finite = std::isfinite(fit.chi2);
      for (const ResponsePoint& point : c.response)
        finite = finite && std::isfinite(std::abs(fit.zpk.at(point.omega_rad_s)));
      if (!finite) ++not_finite;
      if (c.answer_known) {
        ++known;
        double relative = 0.0;
        for (const ResponsePoint& point : c.response)
          relative =
              std::max(relative, std::abs(fit.zpk.at(point.omega_rad_s) / point.response - 1.0));
        if (!(relative < 1e-5)) ++wrong;
      }
    } catch (const std::invalid_argument&) {
      ++refused;
    }
    slowest_ms = std::max(slowest_ms, milliseconds_since(start));
  }
  bench.table.figure("refused with a reason", refused, "");
  bench.table.at_most("answers that are not finite", not_finite, 0.0, "");
  bench.table.figure("exact data of the structure asked for", known, "");
  bench.table.at_most("of these, response wrong by more than 1e-5", wrong, 0.0, "");
  bench.table.at_most("slowest", slowest_ms, 2000.0, "ms");
}

}  // namespace sinerig::bench
