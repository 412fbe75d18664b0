// The Gram matrix of the regressors over the parts of a block. Tones are whole cycles in a block,
// so part k of every block has the same one: it is summed in the first block and known in all
// others, which spares the loop most of what a tick of a regression costs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sweep/nonblocking.h"

namespace sinerig {

class PartGram {
 public:
  PartGram(std::size_t max_order, std::size_t max_parts);

  // `parts` per block after which the regressors repeat but for the drift; 0: they never do.
  void start(std::size_t order, std::size_t parts) noexcept SINERIG_NONBLOCKING;

  // The next tick is the first of a block, wherever the tones are in their cycles.
  void restart() noexcept SINERIG_NONBLOCKING;

  // Whether this part has to be summed: add() is to be called each tick.
  bool learning() const noexcept { return learning_; }

  // A tick's regressors: 1, the drift since the part began, then the rest.
  void add(std::span<const double> x) noexcept SINERIG_NONBLOCKING;

  // Ends the part, which began when the drift stood at `drift`: adds its Gram matrix to `gram`.
  void end_part(double drift, std::span<double> gram) noexcept SINERIG_NONBLOCKING;

 private:
  double* current() noexcept { return &sums_[part_ * width_]; }
  void begin_part() noexcept;

  std::size_t width_;
  std::size_t order_ = 0;
  std::size_t parts_ = 0;
  std::size_t part_ = 0;
  bool first_block_ = true;
  bool learning_ = true;
  std::vector<double> sums_;
};

// gram += sign · x xᵀ for a stored triangle.
void add_outer(double* gram, const double* x, std::size_t order, double sign) noexcept;

}  // namespace sinerig
