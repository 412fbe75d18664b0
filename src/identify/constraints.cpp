#include "identify/constraints.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "identify/linear_stage.h"

namespace sinerig::identify {

namespace {

using Complex = std::complex<double>;

// A root on the axis itself is moved off it by this part of its magnitude.
constexpr double off_axis = 1e-6;
// Of the delay found without constraints.
constexpr std::array delays_tried{1.0, 0.5, 0.0};
constexpr int most_iterations = 120;
// Damping, or real pole over the lowest frequency, below which a root is held by the limit alone.
constexpr double at_the_limit = 1e-3;
constexpr double below_the_band = 0.3;  // of the first frequency

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

bool any_near_axis(const FitData& data, const std::vector<Complex>& roots) {
  return std::any_of(roots.begin(), roots.end(),
                     [&](Complex root) { return near_axis(root, data.x[0]); });
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

  // What pushed a pole to the right is often a delay that is too long: shorter ones compete.
  Refined best;
  best.rational.cost = std::numeric_limits<double>::infinity();
  int iterations = refined.iterations;
  for (const double part : delays_tried) {
    GridRational start = refined.rational;
    if (part < 1.0 && (!freedom.delay || !mirror_poles)) continue;
    start.delay_s = std::max(part * start.delay_s, freedom.delay ? freedom.least_delay_s : 0.0);
    if (part == 1.0) start.delay_s = refined.rational.delay_s;
    if (mirror_poles) {
      const Eigen::ArrayXcd D = mirrored(data, start.D, poles);
      start = numerator_for(data, start.delay_s, D, freedom.degrees.numerator);
    }
    if (freedom.stable_zeros) {
      const LocalModel after(data, unconstrained, start);
      start.N = mirrored(data, start.N, after.N_basis().roots(after.parameters().n));
    }
    const Refined constrained = refine(data, freedom, start, most_iterations);
    iterations += constrained.iterations;
    if (best.rational.N.size() == 0 || constrained.rational.cost < best.rational.cost)
      best = constrained;
  }
  refined = best;
  refined.iterations = iterations;
}

bool near_axis(Complex root, double first) {
  return std::abs(root.real()) < at_the_limit * std::max(std::abs(root), first);
}

bool hides_origin(const std::vector<Complex>& zeros, double first) {
  return std::any_of(zeros.begin(), zeros.end(), [first](Complex zero) {
    return zero != 0.0 && std::abs(zero) < below_the_band * first;
  });
}

bool held_by_constraints(const FitData& data, const Freedom& freedom, const Refined& refined,
                         int origin) {
  if (!freedom.stable_poles && !freedom.stable_zeros) return false;
  const LocalModel model(data, freedom, refined.rational);
  if (freedom.stable_poles && origin > 0 &&
      hides_origin(model.N_basis().roots(model.parameters().n), data.x[0]))
    return true;
  return (freedom.stable_poles &&
          any_near_axis(data, model.D_basis().roots(model.parameters().d))) ||
         (freedom.stable_zeros && any_near_axis(data, model.N_basis().roots(model.parameters().n)));
}

}  // namespace sinerig::identify
