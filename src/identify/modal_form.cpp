#include "identify/modal_form.h"

#include <algorithm>
#include <cmath>

namespace sinerig::identify {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double too_close = 1e-6;

// The model with common roots at the origin cancelled.
struct Parts {
  std::vector<Complex> zeros;
  std::vector<Complex> poles;  // away from the origin, by rising magnitude
  std::size_t at_origin = 0;
  double gain;

  explicit Parts(const ZerosPolesGain& model) : zeros(model.zeros), gain(model.gain) {
    for (const Complex pole : model.poles) {
      const auto zero = std::find(zeros.begin(), zeros.end(), Complex{0.0});
      if (pole != 0.0)
        poles.push_back(pole);
      else if (zero != zeros.end())
        zeros.erase(zero);
      else
        ++at_origin;
    }
    std::stable_sort(poles.begin(), poles.end(),
                     [](Complex a, Complex b) { return std::abs(a) < std::abs(b); });
  }

  bool distinct() const {
    for (std::size_t i = 0; i < poles.size(); ++i)
      for (std::size_t j = i + 1; j < poles.size(); ++j)
        if (std::abs(poles[i] - poles[j]) < too_close * std::abs(poles[j])) return false;
    return true;
  }

  // Factors in turn from both lists, so that the product stays in range.
  Complex residue(std::size_t p) const {
    Complex value = gain;
    std::size_t z = 0;
    const auto take_zero = [&] {
      if (z < zeros.size()) value *= poles[p] - zeros[z++];
    };
    for (std::size_t i = 0; i < poles.size(); ++i) {
      if (i == p) continue;
      value /= poles[p] - poles[i];
      take_zero();
    }
    for (std::size_t i = 0; i < at_origin; ++i) {
      value /= poles[p];
      take_zero();
    }
    while (z < zeros.size()) take_zero();
    return value;
  }

  // c_0 … of s^at_origin · G = c_0 + c_1 s + …, as many as there are poles at the origin.
  std::vector<double> series_at_origin() const {
    std::vector<Complex> series(at_origin, 0.0);
    if (series.empty()) return {};
    series[0] = gain;
    std::size_t z = 0;
    const auto take_zero = [&] {
      if (z == zeros.size()) return;
      for (std::size_t i = series.size(); i-- > 0;)
        series[i] = -zeros[z] * series[i] + (i > 0 ? series[i - 1] : 0.0);
      ++z;
    };
    for (const Complex pole : poles) {
      for (std::size_t i = 0; i < series.size(); ++i)
        series[i] = (series[i] - (i > 0 ? series[i - 1] : 0.0)) / -pole;
      take_zero();
    }
    while (z < zeros.size()) take_zero();
    std::vector<double> real;
    for (const Complex each : series) real.push_back(each.real());
    return real;
  }
};

// x_1' = g u, x_(i+1)' = rate·x_i, so x_i = g rate^(i−1)/s^i · u.
void add_integrators(const Parts& parts, StateSpace& out) {
  const std::vector<double> series = parts.series_at_origin();
  const auto count = static_cast<Index>(series.size());
  if (count == 0) return;
  const double rate = parts.poles.empty() ? 1.0 : std::abs(parts.poles.front());
  VectorXd C(count);
  for (Index i = 0; i < count; ++i)
    C[i] = series[static_cast<std::size_t>(count - 1 - i)] / std::pow(rate, i);
  const double size = std::sqrt(C.norm());
  const double g = size > 0.0 ? size : 1.0;
  out.B[0] = g;
  for (Index i = 0; i < count; ++i) {
    out.C[i] = C[i] / g;
    if (i > 0) out.A(i, i - 1) = rate;
  }
}

}  // namespace

StateSpace to_modal_form(const ZerosPolesGain& model) {
  const Parts parts(model);
  if (model.zeros.size() > model.poles.size() || !parts.distinct()) return to_state_space(model);
  const auto order = static_cast<Index>(parts.poles.size() + parts.at_origin);
  StateSpace out{
      MatrixXd::Zero(order, order), VectorXd::Zero(order), Eigen::RowVectorXd::Zero(order),
      parts.zeros.size() == parts.poles.size() + parts.at_origin ? model.gain : 0.0, model.delay_s};
  add_integrators(parts, out);
  auto at = static_cast<Index>(parts.at_origin);
  for (std::size_t i = 0; i < parts.poles.size(); ++i) {
    const Complex pole = parts.poles[i];
    if (pole.imag() < 0.0) continue;
    const Complex residue = parts.residue(i);
    const double size = std::abs(residue);
    if (pole.imag() == 0.0) {
      const double b = size > 0.0 ? std::sqrt(size) : 1.0;
      out.A(at, at) = pole.real();
      out.B[at] = b;
      out.C[at] = residue.real() / b;
      ++at;
      continue;
    }
    // x_1 + j x_2 obeys ξ' = conj(pole) ξ + b u; y = 2 Re(conj(residue)/b · ξ).
    const double b = size > 0.0 ? std::sqrt(2.0 * size) : 1.0;
    out.A.block(at, at, 2, 2) << pole.real(), pole.imag(), -pole.imag(), pole.real();
    out.B[at] = b;
    out.C[at] = 2.0 * residue.real() / b;
    out.C[at + 1] = 2.0 * residue.imag() / b;
    at += 2;
  }
  return out;
}

}  // namespace sinerig::identify
