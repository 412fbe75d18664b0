#include "sweep/correlator.h"

#include <algorithm>

namespace sinerig {

Correlator::Correlator(std::size_t channels, std::size_t max_tones)
    : channels_{channels}, means_(channels), sums_(channels * max_tones) {}

void Correlator::start(std::size_t tones, std::uint64_t samples) noexcept {
  tones_ = tones;
  samples_ = samples;
  count_ = 0;
  std::fill(means_.begin(), means_.end(), CompensatedSum{});
  std::fill(sums_.begin(), sums_.end(), Sums{});
}

void Correlator::add(std::span<const Phasor> phasors, std::span<const double> values) noexcept {
  auto sums = sums_.begin();
  for (std::size_t channel = 0; channel < channels_; ++channel) {
    const double value = values[channel];
    means_[channel].add(value);
    for (const Phasor& phasor : phasors) {
      sums->cosine.add(value * phasor.cosine);
      sums->sine.add(value * phasor.sine);
      ++sums;
    }
  }
  ++count_;
}

Coefficients Correlator::coefficients(std::size_t channel, std::size_t tone) const noexcept {
  const Sums& sums = sums_[channel * tones_ + tone];
  const auto samples = static_cast<double>(samples_);
  return {.a = 2.0 / samples * sums.cosine.value(),
          .b = 2.0 / samples * sums.sine.value(),
          .mean = means_[channel].value() / samples};
}

}  // namespace sinerig
