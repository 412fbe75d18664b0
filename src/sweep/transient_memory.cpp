#include "sweep/transient_memory.h"

#include <algorithm>
#include <cmath>

namespace sinerig {

TransientBound TransientMemory::bound(std::complex<double> response, double omega_rad_s,
                                      double amplitude) const noexcept {
  if (count_ == 0) return {};
  TransientBound bound{.size = 0.0, .rate_rad_s = 0.0};
  Lesson here{.omega_rad_s = omega_rad_s, .amplitude = amplitude, .response = response};
  double slowness = 0.0;
  for (std::size_t i = 0; i < count_; ++i) {
    const Lesson& there = lessons_[i];
    const double change = std::abs(there.response - here.response);
    const double output_change =
        std::abs(there.amplitude * there.response - here.amplitude * here.response);
    bound.size = std::max(bound.size, output_change / (here.amplitude * std::abs(here.response)));
    const double apart = std::abs(there.omega_rad_s - here.omega_rad_s);
    slowness = std::max(slowness, change / (apart * std::abs(there.response)));
    here = there;
  }
  bound.rate_rad_s = 1.0 / slowness;
  return bound;
}

void TransientMemory::learn(std::complex<double> response, double omega_rad_s,
                            double amplitude) noexcept {
  lessons_[1] = lessons_[0];
  lessons_[0] = {.omega_rad_s = omega_rad_s, .amplitude = amplitude, .response = response};
  count_ = std::min(count_ + 1, lessons_.size());
}

}  // namespace sinerig
