#include "sweep/part_gram.h"

#include <algorithm>

#include "sweep/normal_equations.h"

namespace sinerig {

namespace {

// With the order known to the compiler.
template <std::size_t order>
void add_outer_of(double* gram, const double* x, double sign) noexcept {
  for (std::size_t i = 0; i < order; ++i) {
    const double factor = sign * x[i];
    for (std::size_t j = 0; j <= i; ++j) gram[triangle(i) + j] += factor * x[j];
  }
}

}  // namespace

void add_outer(double* gram, const double* x, std::size_t order, double sign) noexcept {
  switch (order) {
    case 4: return add_outer_of<4>(gram, x, sign);
    case 6: return add_outer_of<6>(gram, x, sign);
    case 8: return add_outer_of<8>(gram, x, sign);
    case 10: return add_outer_of<10>(gram, x, sign);
    default: break;
  }
  for (std::size_t i = 0; i < order; ++i) {
    const double factor = sign * x[i];
    for (std::size_t j = 0; j <= i; ++j) gram[j] += factor * x[j];
    gram += i + 1;
  }
}

PartGram::PartGram(std::size_t max_order, std::size_t max_parts)
    : width_{triangle(max_order)}, sums_(max_parts * width_) {}

void PartGram::start(std::size_t order, std::size_t parts) noexcept {
  order_ = order;
  parts_ = parts;
  restart();
}

void PartGram::restart() noexcept {
  part_ = 0;
  first_block_ = true;
  begin_part();
}

void PartGram::begin_part() noexcept {
  learning_ = first_block_ || parts_ == 0;
  if (learning_) std::fill_n(current(), triangle(order_), 0.0);
}

void PartGram::add(std::span<const double> x) noexcept {
  add_outer(current(), x.data(), order_, 1.0);
}

void PartGram::end_part(double drift, std::span<double> gram) noexcept {
  // The drift is that at the beginning of the part and what has passed since, x₁ = d + τ: to its
  // row d times the constant's is added, to its square 2 d Σ τ + d² n.
  const double* part = current();
  const double samples = part[0];
  gram[0] += samples;
  gram[1] += drift * samples + part[1];
  gram[2] += drift * (drift * samples + 2.0 * part[1]) + part[2];
  for (std::size_t row = 2; row < order_; ++row) {
    const std::size_t at = triangle(row);
    gram[at + 1] += drift * part[at];
    for (std::size_t i = at; i <= at + row; ++i) gram[i] += part[i];
  }
  if (parts_ > 0 && ++part_ == parts_) {
    part_ = 0;
    first_block_ = false;
  }
  begin_part();
}

}  // namespace sinerig
