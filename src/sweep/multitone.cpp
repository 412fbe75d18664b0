#include "sweep/multitone.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <random>

namespace sinerig {

namespace {

constexpr double two_pi = 2.0 * std::numbers::pi;
constexpr std::uint64_t most_cycles = 256;

// Blocks tried for one number of cycles, spread over the tolerance of the lowest tone.
constexpr std::uint64_t most_candidates = 512;

// A block longer than this is looked at in this many places only.
constexpr std::uint64_t most_looks = std::uint64_t{1} << 17;
constexpr std::size_t crest_looks = 4096;
constexpr int random_phase_sets = 200;

// The whole (or odd) number nearest to x.
std::uint64_t nearest_bin(double x, bool odd) {
  const double nearest = odd ? 2.0 * std::round((x - 1.0) / 2.0) + 1.0 : std::round(x);
  return nearest < 1.0 ? 1 : static_cast<std::uint64_t>(nearest);
}

// Worst relative error of the tones above the lowest; 2 where two share a bin or one is too high.
double fit_bins(std::span<const double> frequencies_hz, double rate_hz, bool odd_bins,
                CommonBlock& block) {
  const double per_hz = static_cast<double>(block.samples) / rate_hz;
  double worst = 0.0;
  for (std::size_t i = 1; i < frequencies_hz.size(); ++i) {
    const double wanted = frequencies_hz[i] * per_hz;
    block.cycles[i] = nearest_bin(wanted, odd_bins);
    if (block.cycles[i] <= block.cycles[i - 1] || 2 * block.cycles[i] >= block.samples) return 2.0;
    worst = std::max(worst, std::abs(static_cast<double>(block.cycles[i]) / wanted - 1.0));
  }
  return worst;
}

double peak_of(const CommonBlock& block, std::span<const double> amplitudes,
               std::span<const double> phases_rad, const std::vector<double>& sines) {
  std::vector<double> sum(crest_looks);
  for (std::size_t i = 0; i < amplitudes.size(); ++i) {
    const double turns = phases_rad[i] / two_pi;
    auto at = static_cast<std::size_t>((turns - std::floor(turns)) * crest_looks) % crest_looks;
    const std::size_t step = block.cycles[i] % crest_looks;
    for (double& each : sum) {
      each += amplitudes[i] * sines[at];
      at = (at + step) % crest_looks;
    }
  }
  double peak = 0.0;
  for (const double each : sum) peak = std::max(peak, std::abs(each));
  return peak;
}

// Calls visit(Σ A e^{j(ωt + φ)}, sample) over the block, each tone apart.
template <typename Visit>
void walk(const CommonBlock& block, std::span<const double> amplitudes,
          std::span<const double> phases_rad, Visit visit) {
  const std::uint64_t looks = std::min(block.samples, most_looks);
  const std::uint64_t stride = (block.samples + looks - 1) / looks;
  std::vector<std::complex<double>> tones(amplitudes.size());
  std::vector<std::complex<double>> turn(amplitudes.size());
  for (std::size_t i = 0; i < tones.size(); ++i) {
    const double per_sample =
        two_pi * static_cast<double>(block.cycles[i]) / static_cast<double>(block.samples);
    tones[i] = std::polar(amplitudes[i], phases_rad[i]);
    turn[i] = std::polar(1.0, per_sample * static_cast<double>(stride));
  }
  for (std::uint64_t sample = 0; sample < block.samples; sample += stride) {
    visit(tones, sample);
    for (std::size_t i = 0; i < tones.size(); ++i) tones[i] *= turn[i];
  }
}

}  // namespace

std::vector<std::vector<double>> interleaved(std::vector<double> frequencies_hz,
                                             std::size_t tones) {
  std::sort(frequencies_hz.begin(), frequencies_hz.end());
  frequencies_hz.erase(std::unique(frequencies_hz.begin(), frequencies_hz.end()),
                       frequencies_hz.end());
  const std::size_t count = (frequencies_hz.size() + tones - 1) / tones;
  std::vector<std::vector<double>> groups(count);
  for (std::size_t i = 0; i < frequencies_hz.size(); ++i) {
    groups[i % count].push_back(frequencies_hz[i]);
  }
  return groups;
}

CommonBlock common_block(std::span<const double> frequencies_hz, double rate_hz, double tolerance,
                         double tones_tolerance, bool odd_bins) {
  CommonBlock block;
  block.cycles.resize(frequencies_hz.size());
  const double lowest_hz = frequencies_hz.front();
  for (std::uint64_t cycles = 1; cycles <= most_cycles; cycles += odd_bins ? 2 : 1) {
    const double exact = static_cast<double>(cycles) * rate_hz / lowest_hz;
    const auto from = static_cast<std::uint64_t>(std::ceil(exact / (1.0 + tolerance)));
    const auto to = static_cast<std::uint64_t>(std::floor(exact / (1.0 - tolerance)));
    if (to < from) continue;
    const std::uint64_t stride = (to - from) / most_candidates + 1;
    double best = tones_tolerance;
    std::uint64_t samples = 0;
    block.cycles[0] = cycles;
    for (block.samples = from; block.samples <= to; block.samples += stride) {
      if (2 * cycles >= block.samples) continue;
      const double worst = fit_bins(frequencies_hz, rate_hz, odd_bins, block);
      if (worst > best || (worst == best && samples != 0)) continue;
      best = worst;
      samples = block.samples;
    }
    if (samples == 0) continue;
    block.samples = samples;
    fit_bins(frequencies_hz, rate_hz, odd_bins, block);
    return block;
  }
  return {};
}

std::vector<double> low_crest_phases(const CommonBlock& block, std::span<const double> amplitudes) {
  const std::size_t count = amplitudes.size();
  std::vector<double> sines(crest_looks);
  for (std::size_t i = 0; i < crest_looks; ++i) {
    sines[i] = std::sin(two_pi * static_cast<double>(i) / static_cast<double>(crest_looks));
  }
  std::vector<double> best(count);
  for (std::size_t i = 0; i < count; ++i) {
    best[i] = std::numbers::pi * static_cast<double>(i * i) / static_cast<double>(count);
  }
  double lowest = peak_of(block, amplitudes, best, sines);
  std::mt19937_64 generator{1};
  std::vector<double> phases(count);
  for (int set = 0; set < random_phase_sets; ++set) {
    for (double& phase : phases) {
      phase = two_pi * static_cast<double>(generator() >> 11) * 0x1p-53;
    }
    const double peak = peak_of(block, amplitudes, phases, sines);
    if (peak >= lowest) continue;
    lowest = peak;
    best = phases;
  }
  double smallest = std::numeric_limits<double>::infinity();
  std::vector<double> moved = best;
  walk(block, amplitudes, best, [&](const auto& tones, std::uint64_t) {
    double value = 0.0;
    for (const auto& tone : tones) value += tone.imag();
    if (std::abs(value) >= smallest) return;
    smallest = std::abs(value);
    for (std::size_t i = 0; i < count; ++i) moved[i] = std::arg(tones[i]);
  });
  return moved;
}

TonePeaks peaks_of(const CommonBlock& block, std::span<const double> amplitudes,
                   std::span<const double> phases_rad, double rate_hz) {
  TonePeaks peaks;
  walk(block, amplitudes, phases_rad, [&](const auto& tones, std::uint64_t) {
    double value = 0.0;
    double per_s = 0.0;
    double per_s2 = 0.0;
    for (std::size_t i = 0; i < tones.size(); ++i) {
      const double omega_rad_s = two_pi * rate_hz * static_cast<double>(block.cycles[i]) /
                                 static_cast<double>(block.samples);
      value += tones[i].imag();
      per_s += omega_rad_s * tones[i].real();
      per_s2 -= omega_rad_s * omega_rad_s * tones[i].imag();
    }
    peaks.value = std::max(peaks.value, std::abs(value));
    peaks.per_s = std::max(peaks.per_s, std::abs(per_s));
    peaks.per_s2 = std::max(peaks.per_s2, std::abs(per_s2));
  });
  return peaks;
}

}  // namespace sinerig
