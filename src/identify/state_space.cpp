#include "identify/state_space.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/LU>

#include "identify/sections.h"

namespace sinerig::identify {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double tick_tolerance = 1e-9;  // as the hold: a delay this close to whole ticks is whole

Complex resolvent(const MatrixXd& A, const VectorXd& B, const Eigen::RowVectorXd& C, double D,
                  Complex q) {
  if (A.rows() == 0) return D;
  const Eigen::MatrixXcd pencil = q * Eigen::MatrixXcd::Identity(A.rows(), A.rows()) - A;
  const Eigen::VectorXcd x = pencil.partialPivLu().solve(B.cast<Complex>());
  return (C.cast<Complex>() * x)(0) + D;
}

int order_of(const Section& section) {
  return section.den[0] != 0.0 ? 2 : section.den[1] != 0.0 ? 1 : 0;
}

// Controllable canonical form with s = rate·σ.
StateSpace realised(const Section& section) {
  const int order = order_of(section);
  StateSpace out{MatrixXd::Zero(order, order), VectorXd::Zero(order),
                 Eigen::RowVectorXd::Zero(order), section.num[0], 0.0};
  const auto& [n2, n1, n0] = section.num;
  const auto& [d2, d1, d0] = section.den;
  if (order == 0) {
    out.D = n0 / d0;
  } else if (order == 1) {
    const double rate = d0 != 0.0 ? std::abs(d0) : 1.0;
    out.A(0, 0) = -d0;
    out.B[0] = rate;
    out.D = n1;
    out.C[0] = (n0 - n1 * d0) / rate;
  } else {
    const double rate = std::max({std::sqrt(std::abs(d0)), std::abs(d1), 1e-150});
    const double r = d0 == 0.0 && d1 == 0.0 ? 1.0 : rate;
    out.A << 0.0, r, -d0 / r, -d1;
    out.B << 0.0, r;
    out.C << (n0 - n2 * d0) / (r * r), (n1 - n2 * d1) / r;
  }
  return out;
}

StateSpace in_series(const StateSpace& first, const StateSpace& second) {
  const Index n = first.A.rows();
  const Index m = second.A.rows();
  StateSpace chain{MatrixXd::Zero(n + m, n + m), VectorXd(n + m), Eigen::RowVectorXd(n + m),
                   first.D * second.D, 0.0};
  chain.A.topLeftCorner(n, n) = first.A;
  chain.A.bottomRightCorner(m, m) = second.A;
  chain.A.bottomLeftCorner(m, n) = second.B * first.C;
  chain.B << first.B, second.B * first.D;
  chain.C << second.D * first.C, second.C;
  return chain;
}

struct Held {
  MatrixXd phi;
  VectorXd gamma;
};

// exp(A·t) and the integral of exp(A·τ) dτ·B from 0 to t.
Held held_over(const StateSpace& system, double t) {
  const Index n = system.A.rows();
  MatrixXd block = MatrixXd::Zero(n + 1, n + 1);
  block.topLeftCorner(n, n) = system.A * t;
  block.topRightCorner(n, 1) = system.B * t;
  const MatrixXd exponential = matrix_exponential(block);
  return {exponential.topLeftCorner(n, n), exponential.topRightCorner(n, 1)};
}

}  // namespace

Complex StateSpace::at(double omega_rad_s) const {
  return resolvent(A, B, C, D, {0.0, omega_rad_s}) * std::polar(1.0, -omega_rad_s * delay_s);
}

Complex SampledStateSpace::at(double omega_rad_s) const {
  const double angle = omega_rad_s * period_s;
  return resolvent(A, B, C, D, std::polar(1.0, angle)) * std::polar(1.0, -angle * delay_ticks);
}

StateSpace to_state_space(const ZerosPolesGain& model) {
  StateSpace chain{MatrixXd(0, 0), VectorXd(0), Eigen::RowVectorXd(0), 1.0, 0.0};
  for (const Section& section : second_order_sections(model))
    chain = in_series(chain, realised(section));
  chain.delay_s = model.delay_s;
  return chain;
}

SampledStateSpace zero_order_hold(const StateSpace& system, double period_s) {
  if (!(period_s > 0.0) || !std::isfinite(period_s))
    throw std::invalid_argument("hold: the period must be above 0 s");
  if (!(system.delay_s >= 0.0))
    throw std::invalid_argument("hold: the delay must not be below 0 s");
  const double ticks = system.delay_s / period_s;
  const double whole = std::floor(ticks + tick_tolerance);
  const double fraction = std::max(0.0, ticks - whole);
  const Held full = held_over(system, period_s);
  if (fraction < tick_tolerance)
    return {full.phi, full.gamma, system.C, system.D, period_s, static_cast<int>(whole)};
  // For the first part of a period the input of the tick before acts, then that of this one.
  const Held late = held_over(system, (1.0 - fraction) * period_s);
  const VectorXd before = full.gamma - late.gamma;
  const Index n = system.A.rows();
  SampledStateSpace out{
      MatrixXd::Zero(n + 1, n + 1), VectorXd(n + 1), Eigen::RowVectorXd(n + 1), 0.0, period_s,
      static_cast<int>(whole)};
  out.A.topLeftCorner(n, n) = full.phi;
  out.A.topRightCorner(n, 1) = before;
  out.B << late.gamma, 1.0;
  out.C << system.C, system.D;
  return out;
}

MatrixXd matrix_exponential(const MatrixXd& M) {
  const double norm = M.size() == 0 ? 0.0 : M.cwiseAbs().rowwise().sum().maxCoeff();
  const int squarings = norm > 0.25 ? static_cast<int>(std::ceil(std::log2(norm / 0.25))) : 0;
  const MatrixXd scaled = M / std::ldexp(1.0, squarings);
  MatrixXd sum = MatrixXd::Identity(M.rows(), M.cols());
  MatrixXd term = sum;
  constexpr int terms = 14;  // 0.25^14 / 14! < 1e-19
  for (int k = 1; k <= terms; ++k) {
    term = term * scaled / k;
    sum += term;
  }
  for (int i = 0; i < squarings; ++i) sum = (sum * sum).eval();
  return sum;
}

}  // namespace sinerig::identify
