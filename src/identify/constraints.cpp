#include "identify/constraints.h"

#include <algorithm>
#include <cmath>

#include "identify/linear_stage.h"

namespace sinerig::identify {

namespace {

using Complex = std::complex<double>;

// A root on the axis itself is moved off it by this part of its magnitude.
constexpr double off_axis = 1e-6;

bool all_left(const std::vector<Complex>& roots) {
  return std::all_of(roots.begin(), roots.end(), [](Complex root) { return root.real() < 0.0; });
}

Eigen::ArrayXcd mirrored(const FitData& data, Eigen::ArrayXcd values,
                         const std::vector<Complex>& roots) {
  const Eigen::ArrayXcd s = data.x * Complex{0.0, 1.0};
  for (const Complex root : roots) {
    if (root.real() < 0.0) continue;
    const double real = std::max(root.real(), off_axis * std::abs(root) + 1e-12);
    values *= (s - Complex{-real, root.imag()}) / (s - root);
  }
  return values;
}

}  // namespace

void enforce_constraints(const FitData& data, const Freedom& freedom, Refined& refined) {
  if (!freedom.stable_poles && !freedom.stable_zeros) return;
  Freedom unconstrained = freedom;
  unconstrained.stable_poles = unconstrained.stable_zeros = false;
  const LocalModel model(data, unconstrained, refined.rational);
  const auto poles = model.D_basis().roots(model.parameters().d);
  const auto zeros = model.N_basis().roots(model.parameters().n);
  const bool mirror_poles = freedom.stable_poles && !all_left(poles);
  const bool mirror_zeros = freedom.stable_zeros && !all_left(zeros);
  if (!mirror_poles && !mirror_zeros) return;

  GridRational start = refined.rational;
  if (mirror_poles) {
    const Eigen::ArrayXcd D = mirrored(data, start.D, poles);
    start = numerator_for(data, start.delay_s, D, freedom.degrees.numerator);
  }
  if (freedom.stable_zeros) {
    const LocalModel after(data, unconstrained, start);
    start.N = mirrored(data, start.N, after.N_basis().roots(after.parameters().n));
  }
  Refined constrained = refine(data, freedom, start);
  constrained.iterations += refined.iterations;
  refined = constrained;
}

}  // namespace sinerig::identify
