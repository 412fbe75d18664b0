// A model as a chain of second-order sections: the form to run and to store at high order.
#pragma once

#include <array>
#include <complex>
#include <vector>

#include "identify/transfer_function.h"

namespace sinerig::identify {

// (num[0] s² + num[1] s + num[2]) / (den[0] s² + den[1] s + den[2]); the first coefficients are
// zero where the section is of lower order. den monic in its highest power.
struct Section {
  std::array<double, 3> num{0.0, 0.0, 1.0};
  std::array<double, 3> den{0.0, 0.0, 1.0};

  std::complex<double> at(std::complex<double> s) const;
};

// Sections whose product is the model without its delay. Poles pair with their conjugates, real
// ones with one another by magnitude; the least damped pole pair picks the nearest zeros first, so
// that no section peaks more than it has to, and stands last, after the others have attenuated what
// reaches it (the rule of Jackson, Digital Filters and Signal Processing, ch. 11). The gain is
// spread: at the geometric mean of the pole magnitudes every section has the same gain.
// Throws std::invalid_argument when there are more zeros than poles, or roots without conjugate.
std::vector<Section> second_order_sections(const ZerosPolesGain& model);

}  // namespace sinerig::identify
