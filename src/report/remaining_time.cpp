#include "report/remaining_time.h"

#include <algorithm>

namespace sinerig::report {

void RemainingTime::update(std::uint32_t dwell, std::uint64_t tick) {
  const auto last = static_cast<std::uint32_t>(plan_.dwells.size());
  while (dwell_ < dwell) {
    if (dwell_ < last) least_so_far_ += plan_.dwells[dwell_].min_samples();
    ++dwell_;
    dwell_tick_ = tick;
  }
  tick_ = tick;
}

double RemainingTime::elapsed_s() const {
  return static_cast<double>(tick_) / plan_.rate_hz;
}

double RemainingTime::dwell_s() const {
  return static_cast<double>(tick_ - dwell_tick_) / plan_.rate_hz;
}

double RemainingTime::remaining_s() const {
  const double stretch =
      least_so_far_ == 0
          ? 1.0
          : std::max(1.0, static_cast<double>(dwell_tick_) / static_cast<double>(least_so_far_));
  const double least_left_s =
      static_cast<double>(plan_.min_samples() - least_so_far_) / plan_.rate_hz;
  if (dwell_ >= plan_.dwells.size()) return 0.0;
  const double this_dwell_s =
      stretch * static_cast<double>(plan_.dwells[dwell_].min_samples()) / plan_.rate_hz;
  return std::max(0.0, stretch * least_left_s - std::min(dwell_s(), this_dwell_s));
}

double RemainingTime::done() const {
  if (dwell_ >= plan_.dwells.size()) return 1.0;
  const double whole_s = elapsed_s() + remaining_s();
  return whole_s > 0.0 ? elapsed_s() / whole_s : 0.0;
}

}  // namespace sinerig::report
