#include "bench/lateness.h"

#include <algorithm>
#include <numeric>
#include <random>

namespace sinerig::bench {

namespace {

using realtime::LatencyHistogram;

LatencyHistogram merged(const Rounds& rounds, const std::vector<std::size_t>& chosen) {
  LatencyHistogram all;
  for (const std::size_t round : chosen) all.merge(rounds[round]);
  return all;
}

std::vector<std::size_t> each_once(const Rounds& rounds) {
  std::vector<std::size_t> all(rounds.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return all;
}

}  // namespace

double quantile_us(const LatencyHistogram& histogram, double part) {
  const double wanted = part * static_cast<double>(histogram.count());
  double seen = 0.0;
  for (const auto& [microseconds, count] : histogram.filled_bins()) {
    const auto here = static_cast<double>(count);
    if (seen + here >= wanted) return static_cast<double>(microseconds) + (wanted - seen) / here;
    seen += here;
  }
  return 0.0;
}

LatencyHistogram merged(const Rounds& rounds) {
  return merged(rounds, each_once(rounds));
}

// The rounds are drawn again with repetition, those of both contenders together: a stall of the
// machine takes many ticks of one round with it, so ticks are no independent samples.
std::array<Ratio, parts.size()> ratios(const Rounds& ours, const Rounds& theirs) {
  constexpr std::size_t draws = 200;
  std::mt19937_64 random{1};
  std::uniform_int_distribution<std::size_t> any{0, ours.size() - 1};
  std::vector<std::size_t> chosen = each_once(ours);
  std::array<std::vector<double>, parts.size()> drawn;
  std::array<Ratio, parts.size()> found;
  for (std::size_t draw = 0; draw <= draws; ++draw) {
    const LatencyHistogram our = merged(ours, chosen);
    const LatencyHistogram their = merged(theirs, chosen);
    for (std::size_t i = 0; i < parts.size(); ++i) {
      const double ratio = quantile_us(our, parts[i]) / quantile_us(their, parts[i]);
      if (draw == 0) {
        found[i].value = ratio;
      } else {
        drawn[i].push_back(ratio);
      }
    }
    std::generate(chosen.begin(), chosen.end(), [&] { return any(random); });
  }
  for (std::size_t i = 0; i < parts.size(); ++i) {
    std::sort(drawn[i].begin(), drawn[i].end());
    found[i].least = drawn[i][draws / 40];
    found[i].most = drawn[i][draws - 1 - draws / 40];
  }
  return found;
}

}  // namespace sinerig::bench
