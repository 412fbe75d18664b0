// A plant with an incremental encoder on its shaft: finds when the next count border is crossed.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "sim/plant.h"

namespace sinerig::sim {

struct Crossing {
  std::int64_t time_ns = 0;
  int step = 0;  // +1 or −1
};

// Count n is the shaft between (n − 1/2) and (n + 1/2) counts. Times are those of one clock, and do
// not go back.
class Axis {
 public:
  // `output` is the row of the plant that the encoder reads, `per_count` its unit per count.
  Axis(const LinearSystem& system, std::size_t output, double per_count, std::int64_t start_ns);

  // The input becomes `value`. Crossings before have been taken.
  void apply(double value, std::int64_t time_ns);

  // The first crossing after the last one taken and not after `until_ns`, if the input stays.
  std::optional<Crossing> next(std::int64_t until_ns);

  void take(const Crossing& crossing);
  std::int64_t count() const { return count_; }
  double position(std::int64_t time_ns);

 private:
  PlantTime plant_time(std::int64_t time_ns) const;
  bool crossed(Plant& plant, std::int64_t time_ns);
  void settle(std::int64_t time_ns);

  static constexpr std::int64_t period_ns = 1'000'000;
  // Coarse enough to be quick; a shaft that comes back within it hardly left.
  static constexpr std::int64_t stride_ns = period_ns / 16;

  std::int64_t start_ns_;
  Plant plant_;  // stands at time_ns_
  Plant probe_;
  Plant before_;
  std::int64_t time_ns_;
  std::size_t output_;
  double per_count_;
  std::int64_t count_ = 0;
  std::vector<double> outputs_;
};

}  // namespace sinerig::sim
