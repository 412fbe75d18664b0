// bench_fit [--seed N] [--runs N] [--only SECTION] [--motor CSV] [--load CSV]
// Prints what the fits reach beside the bound of each figure. The CSV files are those of a real
// two-mass bench (freq_hz,re,im,std). Exit status: 0 all bounds met, 1 some missed, 2 usage.
#include <cstdio>
#include <cstring>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "fit_cases.h"

int main(int argc, char** argv) {
  using namespace sinerig::bench;
  FitBench bench;
  std::string only;
  std::string motor;
  std::string load;
  for (int i = 1; i < argc; i += 2) {
    const std::string option = argv[i];
    if (i + 1 >= argc) {
      std::fprintf(stderr, "bench fit: %s needs a value\n", argv[i]);
      return 2;
    }
    if (option == "--seed")
      bench.seed = std::stoull(argv[i + 1]);
    else if (option == "--runs")
      bench.runs = std::stoi(argv[i + 1]);
    else if (option == "--only")
      only = argv[i + 1];
    else if (option == "--motor")
      motor = argv[i + 1];
    else if (option == "--load")
      load = argv[i + 1];
    else {
      std::fprintf(stderr, "bench fit: unknown option %s\n", argv[i]);
      return 2;
    }
  }
  std::printf("fit: seed %llu, runs %d\n", static_cast<unsigned long long>(bench.seed), bench.runs);
  const std::vector<std::pair<std::string, std::function<void(FitBench&)>>> sections{
      {"paper", bench_paper},
      {"likelihood", bench_likelihood},
      {"intervals", bench_intervals},
      {"order", bench_order},
      {"hold", bench_hold},
      {"speed", bench_speed},
      {"degenerate", bench_degenerate}};
  for (const auto& [name, run] : sections)
    if (only.empty() || only == name) run(bench);
  if (!motor.empty()) bench_real(bench, motor, 4, 2, 476.0);
  if (!load.empty()) bench_real(bench, load, 4, 0, 132.0);
  return bench.table.finish() == 0 ? 0 : 1;
}
