// `tools/bench quality`: what the estimator is measured by. Each part prints one table, every
// figure beside its bound.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace sinerig::quality {

struct Options {
  std::uint32_t seeds = 0;  // runs per cell; 0 = what the part needs for its bound
  std::uint64_t first_seed = 1;
  unsigned threads = 2;
  std::string rigs;  // folder of the rig files of the four plants

  std::uint32_t seeds_or(std::uint32_t own) const { return seeds > 0 ? seeds : own; }
};

// Every part returns the number of bounds it missed.
int coverage(const Options& options);
int transient(const Options& options);
int efficiency(const Options& options);
int bias(const Options& options);
int bench_time(const Options& options);
int parallel_tones(const Options& options);
int status(const Options& options);
int cost(const Options& options);

// Calls work(i) for every i < count on some threads; the results may not depend on the order.
void in_parallel(std::size_t count, unsigned threads, const std::function<void(std::size_t)>& work);

inline const char* verdict(bool met) {
  return met ? "met" : "MISSED";
}

}  // namespace sinerig::quality
