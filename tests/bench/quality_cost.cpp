// What the estimator costs: ns per tick for 8 channels and 4 harmonics, and that no tick allocates.
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <new>
#include <random>
#include <time.h>
#include <vector>

#include "quality.h"
#include "sweep/excitation.h"
#include "sweep/measurement.h"
#include "sweep/plan.h"

namespace {

std::atomic<std::uint64_t> allocations{0};

void* counted(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc{};
}

}  // namespace

void* operator new(std::size_t size) {
  return counted(size);
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}

namespace sinerig::quality {

namespace {

constexpr double rate_hz = 1000.0;
constexpr std::size_t channels = 8;
constexpr double most_ns = 1000.0;

struct Cost {
  double mean_ns = 0.0;
  std::uint64_t allocations = 0;
};

// Of this thread: other work on the machine does not count.
double cpu_ns() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e9 * static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec);
}

// One dwell of 50 s that never meets its target, so that it is judged all the way.
Cost measure(double lost_fraction, double jitter_ns) {
  SweepSettings sweep;
  sweep.spacing = Spacing::list;
  sweep.frequencies_hz = {10.0};
  sweep.amplitude = 1.0;
  sweep.harmonics = 4;
  sweep.target_db = 1e-6;
  sweep.integrate_max = {.cycles = 0.0, .seconds = 100.0};
  const SweepPlan plan = plan_sweep(sweep, {}, rate_hz);
  const Dwell& dwell = plan.dwells.front();
  Pairs pairs;
  for (std::size_t i = 1; i < channels; ++i) pairs.push_back({.input = 0, .output = i});
  Measurement measurement{channels, dwell.bins(), 1, pairs, plan.judgement, rate_hz};
  Excitation excitation{1, dwell.bins(), Baseline{}};
  std::mt19937_64 generator{1};
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  constexpr std::size_t ticks = 50000;
  std::vector<Observation> observations(ticks * channels);
  for (std::size_t i = 0; i < ticks * channels; ++i) {
    const bool sensor = i % channels != 0;
    observations[i] = {
        .value = normal(generator),
        .offset_ns = sensor ? static_cast<std::int64_t>(jitter_ns * uniform(generator)) : 0,
        .missing = sensor && uniform(generator) < lost_fraction};
  }
  excitation.start(dwell, 1.0);
  measurement.start(dwell);
  Cost cost;
  const std::uint64_t before = allocations;
  const double begin = cpu_ns();
  for (std::size_t tick = 0; tick < ticks; ++tick) {
    excitation.advance(tick == 0 ? 0 : 1);
    Observation* now = &observations[tick * channels];
    now[0].value = excitation.command();
    measurement.add(excitation.phasors(), {now, channels});
  }
  cost.mean_ns = (cpu_ns() - begin) / ticks;
  cost.allocations = allocations - before;
  return cost;
}

}  // namespace

int cost(const Options&) {
  std::printf(
      "\nCost of the estimator, 8 channels, 4 harmonics, judgements included; bounds 1000 ns a "
      "tick, no allocation\n\n");
  struct Row {
    const char* name;
    double lost;
    double jitter_ns;
  };
  int missed = 0;
  for (const Row& row : {Row{"complete, on the grid", 0.0, 0.0}, Row{"5 % lost", 0.05, 0.0},
                         Row{"every sample off the grid", 0.0, 1e5}}) {
    const Cost each = measure(row.lost, row.jitter_ns);
    const bool met = each.mean_ns <= most_ns && each.allocations == 0;
    std::printf("%-27s %6.0f ns  %llu allocations   %s\n", row.name, each.mean_ns,
                static_cast<unsigned long long>(each.allocations), verdict(met));
    missed += met ? 0 : 1;
  }
  return missed;
}

}  // namespace sinerig::quality
