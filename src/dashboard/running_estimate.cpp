#include "dashboard/running_estimate.h"

#include <cmath>
#include <limits>

#include "record/confidence.h"
#include "sweep/student.h"

namespace sinerig::dashboard {

namespace {

// More blocks than this make no difference that could be seen.
constexpr std::size_t most_blocks = 4096;

}  // namespace

void RunningEstimate::add(const Block& block) {
  if (block.tone != tone_ || (block.channel != input_ && block.channel != output_)) return;
  if (block.attempt != attempt_) {
    pairs_.clear();
    attempt_ = block.attempt;
  }
  if (pairs_.empty() || pairs_.back().block != block.block) {
    if (pairs_.size() == most_blocks)
      pairs_.erase(pairs_.begin(), pairs_.begin() + most_blocks / 2);
    pairs_.push_back({.block = block.block});
  }
  Pair& pair = pairs_.back();
  if (block.channel == input_) {
    pair.input = block.coefficients.phasor();
    pair.has_input = true;
  }
  if (block.channel == output_) {
    pair.output = block.coefficients.phasor();
    pair.has_output = true;
  }
}

std::optional<RunningEstimate::Value> RunningEstimate::value() const {
  std::size_t last = pairs_.size();
  if (last > 0 && !(pairs_.back().has_input && pairs_.back().has_output)) --last;
  if (last == 0) return std::nullopt;
  const std::size_t first = last / 2;
  std::complex<double> input;
  std::complex<double> output;
  for (std::size_t i = first; i < last; ++i) {
    input += pairs_[i].input;
    output += pairs_[i].output;
  }
  if (std::abs(input) == 0.0) return std::nullopt;
  Value value{.blocks = last - first, .response = output / input};
  const double nan = std::numeric_limits<double>::quiet_NaN();
  value.gain_interval_db = value.phase_interval_deg = nan;
  if (value.blocks < 2 || std::abs(value.response) == 0.0) return value;
  double square = 0.0;
  for (std::size_t i = first; i < last; ++i) {
    square += std::norm(pairs_[i].output / pairs_[i].input - value.response);
  }
  const auto count = static_cast<double>(value.blocks);
  const double dof = 2.0 * (count - 1.0);
  const double half =
      student_t_975(dof) * std::sqrt(square / dof / count) / std::abs(value.response);
  value.gain_interval_db = half * record::db_per_relative;
  value.phase_interval_deg = std::fmin(180.0, half * record::degrees_per_radian);
  return value;
}

}  // namespace sinerig::dashboard
