// Sections of the benchmark of fitting; each prints its rows.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "../identify/plants.h"
#include "identify/maximum_likelihood.h"
#include "table.h"

namespace sinerig::bench {

struct FitBench {
  std::uint64_t seed = 1;
  int runs = 200;
  Table table;
};

void bench_paper(FitBench& bench);
void bench_likelihood(FitBench& bench);
void bench_intervals(FitBench& bench);
void bench_order(FitBench& bench);
void bench_hold(FitBench& bench);
void bench_speed(FitBench& bench);
void bench_degenerate(FitBench& bench);
// CSV freq_hz,re,im,std: fitted on the even points, tested on the odd ones.
void bench_real(FitBench& bench, const std::string& path, int poles, int zeros, double bound);

inline identify::FitOptions options_for(const identify::ZerosPolesGain& plant,
                                        identify::Delay delay) {
  identify::FitOptions options;
  options.poles = static_cast<int>(plant.poles.size());
  options.zeros = static_cast<int>(plant.zeros.size());
  for (const auto pole : plant.poles) options.origin += pole == 0.0 ? 1 : 0;
  options.delay = delay;
  if (delay == identify::Delay::known) options.delay_s = plant.delay_s;
  return options;
}

inline double milliseconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
}

}  // namespace sinerig::bench
