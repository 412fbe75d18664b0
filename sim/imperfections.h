// What is wrong with a real actuator and a real sensor, opt-in, seeded, one small block each.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

namespace sinerig::sim {

inline constexpr double never = std::numeric_limits<double>::infinity();

// Independent streams from one seed: SplitMix64 of (seed, stream).
std::uint64_t stream_seed(std::uint64_t seed, std::uint64_t stream) noexcept;

// Noise whose power spectral density falls as 1/f from about rate/2 down over `octaves` octaves: a
// sum of first-order processes of equal variance, their corner frequencies an octave apart.
class PinkNoise {
 public:
  PinkNoise(double rms, std::uint64_t seed);
  double next() noexcept;

 private:
  static constexpr std::size_t octaves = 16;

  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
  std::array<double, octaves> state_{};
  std::array<double, octaves> decay_{};
  double drive_ = 0.0;
};

// Play: the output follows only when the input has crossed the gap.
class Backlash {
 public:
  explicit Backlash(double gap) : half_gap_{gap / 2.0} {}
  double pass(double input) noexcept;

 private:
  double half_gap_;
  double output_ = 0.0;
};

// The nearest multiple of `quantum`; 0 = as it is.
inline double quantise(double value, double quantum) noexcept {
  return quantum > 0.0 ? quantum * std::round(value / quantum) : value;
}

struct ActuatorImperfections {
  double gain = 1.0;    // of the command; -1 is a swapped wire, 0 a drive that is not enabled
  double min = -never;  // clamp; a saturating power stage that reports what it applies
  double max = never;
  double quantum = 0.0;
  double slew_per_s = never;
  double dropout_fraction = 0.0;  // of the commands that are lost: the last one is held
};

struct SensorImperfections {
  double delay_s = 0.0;  // age of a sample when it is read; it carries its true time
  double jitter_s =
      0.0;  // full width of a uniform scatter of the sampling instant, true time known
  double noise_rms = 0.0;       // white
  double pink_noise_rms = 0.0;  // 1/f
  double bias = 0.0;
  double drift_per_s = 0.0;
  double backlash = 0.0;
  double quantum = 0.0;
  double min = -never;  // the sensor clips, and says so with Fault::range
  double max = never;
  double lost_fraction = 0.0;  // of the samples that never arrive
  double late_fraction = 0.0;  // of the ticks that see the sample before again, with its old time
  double stuck_at_s = never;   // from here the value freezes, without a word
};

}  // namespace sinerig::sim
