// What the blocks of the dwell under way tell so far: H with a provisional interval.
#pragma once

#include <complex>
#include <cstdint>
#include <optional>
#include <vector>

#include "sweep/records.h"

namespace sinerig::dashboard {

class RunningEstimate {
 public:
  // Of the response `output` / `input`, as channels of the run, at one tone of the dwell.
  RunningEstimate(std::uint16_t input, std::uint16_t output, std::uint16_t tone = 0)
      : input_{input}, output_{output}, tone_{tone} {}

  // A new attempt begins anew; blocks of other tones are passed over.
  void add(const Block& block);

  struct Value {
    std::size_t blocks = 0;  // behind the value
    std::complex<double> response{};
    double gain_interval_db = 0.0;  // half widths of 95 % intervals; NaN from a single block
    double phase_interval_deg = 0.0;
  };
  // From the later half of the blocks, which the transient has mostly left: H = Σ Y / Σ U, the
  // interval from the scatter of Y_k / U_k about it with Student's t. The point that the loop makes
  // of the dwell is estimated with more care; this is for watching. Empty before the first block.
  std::optional<Value> value() const;

 private:
  struct Pair {
    std::uint32_t block = 0;
    std::complex<double> input{};
    std::complex<double> output{};
    bool has_input = false;
    bool has_output = false;
  };

  std::uint16_t input_;
  std::uint16_t output_;
  std::uint16_t tone_;
  std::uint32_t attempt_ = 0;
  std::vector<Pair> pairs_;
};

}  // namespace sinerig::dashboard
