#include <cmath>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "fit_cases.h"

namespace sinerig::bench {

namespace {

using namespace identify;

Response read_csv(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path + ": cannot be read");
  Response response;
  std::string line;
  while (std::getline(file, line)) {
    if (line.empty() || line[0] == '#' || line[0] == 'f') continue;
    std::istringstream fields(line);
    double frequency_hz = 0.0;
    double re = 0.0;
    double im = 0.0;
    double deviation = 0.0;
    char comma = 0;
    fields >> frequency_hz >> comma >> re >> comma >> im >> comma >> deviation;
    const double variance = deviation * deviation;
    response.push_back({2.0 * std::numbers::pi * frequency_hz, {re, im}, variance, 0.0, variance});
  }
  return response;
}

}  // namespace

void bench_real(FitBench& bench, const std::string& path, int poles, int zeros, double bound) {
  bench.table.section("Real bench, fitted on every other point, tested on the rest: " + path);
  Response fitted;
  Response held_out;
  const Response all = read_csv(path);
  for (std::size_t i = 0; i < all.size(); ++i) (i % 2 == 0 ? fitted : held_out).push_back(all[i]);
  for (const Delay delay : {Delay::none, Delay::fit}) {
    FitOptions options;
    options.poles = poles;
    options.zeros = zeros;
    options.delay = delay;
    const auto start = std::chrono::steady_clock::now();
    const Fit fit = fit_maximum_likelihood(fitted, options);
    const double time_ms = milliseconds_since(start);
    double chi2 = 0.0;
    double rms_db = 0.0;
    for (const ResponsePoint& point : held_out) {
      const std::complex<double> model = fit.zpk.at(point.omega_rad_s);
      chi2 += std::norm(model - point.response) / point.variance_re;
      rms_db += std::pow(20.0 * std::log10(std::abs(model / point.response)), 2);
    }
    const auto points = static_cast<double>(held_out.size());
    const std::string what = std::to_string(poles) + "/" + std::to_string(zeros) +
                             (delay == Delay::fit ? " with delay: " : " without delay: ");
    if (delay == Delay::fit)
      bench.table.at_most(what + "held-out chi2 per real value", chi2 / (2.0 * points),
                          bound * 1.001, "");
    else
      bench.table.figure(what + "held-out chi2 per real value", chi2 / (2.0 * points), "");
    bench.table.figure(what + "held-out rms gain error", std::sqrt(rms_db / points), "dB");
    bench.table.figure(what + "delay", 1e3 * fit.delay_s.value, "ms");
    bench.table.figure(what + "points left out", static_cast<double>(fit.outliers.size()), "");
    bench.table.figure(what + "time", time_ms, "ms");
  }
}

}  // namespace sinerig::bench
