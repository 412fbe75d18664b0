#include "sim/gpio_axis/axis.h"

#include <algorithm>
#include <cmath>

namespace sinerig::sim {

Axis::Axis(const LinearSystem& system, std::size_t output, double per_count, std::int64_t start_ns)
    : start_ns_{start_ns},
      plant_{system, static_cast<double>(period_ns) * 1e-9},
      probe_{plant_},
      before_{plant_},
      time_ns_{start_ns},
      output_{output},
      per_count_{per_count},
      outputs_(plant_.outputs(), 0.0) {}

PlantTime Axis::plant_time(std::int64_t time_ns) const {
  const std::int64_t elapsed_ns = time_ns - start_ns_;
  return {.tick = static_cast<std::uint64_t>(elapsed_ns / period_ns),
          .fraction = static_cast<double>(elapsed_ns % period_ns) / static_cast<double>(period_ns)};
}

void Axis::settle(std::int64_t time_ns) {
  time_ns_ = std::max(time_ns_, time_ns);
  plant_.sample(plant_time(time_ns_), outputs_);
}

void Axis::apply(double value, std::int64_t time_ns) {
  settle(time_ns);
  plant_.make_room();
  plant_.apply(value, plant_time(time_ns_));
}

double Axis::position(std::int64_t time_ns) {
  settle(time_ns);
  return outputs_[output_];
}

bool Axis::crossed(Plant& plant, std::int64_t time_ns) {
  plant.sample(plant_time(time_ns), outputs_);
  const double counts = outputs_[output_] / per_count_ - static_cast<double>(count_);
  return counts < -0.5 || counts >= 0.5;
}

// Strides along the grid until the count has changed, then halves the last stride down to 1 ns.
std::optional<Crossing> Axis::next(std::int64_t until_ns) {
  probe_ = plant_;
  std::int64_t before_ns = time_ns_;
  while (before_ns < until_ns) {
    before_ = probe_;
    const std::int64_t grid_ns = (before_ns - start_ns_) / stride_ns * stride_ns + stride_ns;
    std::int64_t after_ns = std::min(start_ns_ + grid_ns, until_ns);
    if (!crossed(probe_, after_ns)) {
      before_ns = after_ns;
      continue;
    }
    while (after_ns - before_ns > 1) {
      const std::int64_t middle_ns = before_ns + (after_ns - before_ns) / 2;
      probe_ = before_;
      if (crossed(probe_, middle_ns)) {
        after_ns = middle_ns;
      } else {
        before_ns = middle_ns;
        before_ = probe_;
      }
    }
    probe_ = before_;
    crossed(probe_, after_ns);
    const bool up = outputs_[output_] / per_count_ > static_cast<double>(count_);
    return Crossing{.time_ns = after_ns, .step = up ? 1 : -1};
  }
  return std::nullopt;
}

void Axis::take(const Crossing& crossing) {
  settle(crossing.time_ns);
  count_ += crossing.step;
}

}  // namespace sinerig::sim
