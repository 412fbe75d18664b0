#include "identify/motion_problem.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/Dense>

namespace sinerig::identify {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double two_pi = 2.0 * std::numbers::pi;
// Of a column of size one: below, what is left of it is rounding.
constexpr double least_pivot = 1e-9;
constexpr int most_refinements = 20;

bool is_real(Complex pole) {
  return pole.imag() == 0.0;
}
Index size_of(Complex pole) {
  return is_real(pole) ? 1 : 2;
}
// x[k + 1] = z x[k] + gain · drive[k], from rest.
Eigen::VectorXcd filtered(Complex z, Complex gain, const Eigen::VectorXcd& drive) {
  Eigen::VectorXcd x(drive.size());
  Complex state = 0.0;
  for (Index k = 0; k < drive.size(); ++k) {
    x[k] = state;
    state = z * state + gain * drive[k];
  }
  return x;
}

Eigen::VectorXcd free_motion(Complex z, Index ticks) {
  Eigen::VectorXcd x(ticks);
  Complex state = 1.0;
  for (Index k = 0; k < ticks; ++k) {
    x[k] = state;
    state *= z;
  }
  return x;
}

// Real and imaginary part of a signal as columns, the former alone for a real pole.
void put(MatrixXd& matrix, Index& column, const Eigen::VectorXcd& signal, Complex pole) {
  matrix.col(column++) = signal.real();
  if (!is_real(pole)) matrix.col(column++) = signal.imag();
}

// Scales the columns to a size of one each; the sizes that they had.
VectorXd scale_columns(MatrixXd& columns) {
  VectorXd size = columns.colwise().norm().cwiseMax(1e-300).transpose();
  columns = columns * size.cwiseInverse().asDiagonal();
  return size;
}

std::vector<Complex> moved(const std::vector<Complex>& poles, const VectorXd& step, double scale) {
  std::vector<Complex> next;
  Index at = 0;
  for (const Complex& pole : poles) {
    const double sigma =
        std::clamp(pole.real() + scale * step[at], 3.0 * pole.real(), 0.3 * pole.real());
    if (is_real(pole)) {
      next.emplace_back(sigma, 0.0);
    } else {
      const double omega =
          std::clamp(pole.imag() + scale * step[at + 1], 0.7 * pole.imag(), 1.4 * pole.imag());
      next.emplace_back(sigma, omega);
    }
    at += size_of(pole);
  }
  return next;
}

}  // namespace

Index order_of(const std::vector<Complex>& poles) {
  Index order = 0;
  for (const Complex& pole : poles) order += size_of(pole);
  return order;
}

MotionProblem::MotionProblem(const MotionRecord& record, const ModeSettings& settings)
    : period_s_{record.period_s}, settings_{settings}, first_{settings.most_delay_ticks} {
  const auto ticks = static_cast<Index>(record.input.size());
  input_ = Eigen::Map<const VectorXd>(record.input.data(), ticks);
  output_ = Eigen::Map<const VectorXd>(record.output.data(), ticks);
  present_ = VectorXd::Ones(ticks);
  double sum = 0.0;
  for (Index k = 0; k < ticks; ++k) {
    if (std::isfinite(output_[k])) {
      sum += output_[k];
    } else {
      present_[k] = 0.0;
      output_[k] = k > 0 ? output_[k - 1] : 0.0;
    }
  }
  output_.array() -= sum / present_.sum();
}

double MotionProblem::samples() const {
  return present_.tail(ticks() - first_).sum();
}

std::vector<Complex> MotionProblem::spread(int order) const {
  std::vector<Complex> poles;
  const int pairs = order / 2;
  const double low = std::log(two_pi * settings_.lowest_hz);
  const double high = std::log(two_pi * settings_.highest_hz);
  if (order % 2 == 1) poles.emplace_back(-std::exp(low), 0.0);
  for (int i = 0; i < pairs; ++i) {
    const double omega = std::exp(low + (high - low) * (i + 0.5) / pairs);
    poles.emplace_back(-0.02 * omega, omega);
  }
  return poles;
}

std::vector<Complex> MotionProblem::relocated(const std::vector<Complex>& poles) const {
  const Index order = order_of(poles);
  MatrixXd columns(ticks(), 3 * order + common());
  Index column = 0;
  MatrixXd dynamics = MatrixXd::Zero(order, order);
  VectorXd entry = VectorXd::Zero(order);
  const Eigen::VectorXcd seen = output_.cast<Complex>();
  Index row = 0;
  for (const Complex& pole : poles) {
    const Complex z = std::exp(pole * period_s_);
    put(columns, column, filtered(z, 1.0 - z, seen), pole);
    dynamics(row, row) = z.real();
    if (!is_real(pole)) {
      dynamics(row + 1, row + 1) = z.real();
      dynamics(row, row + 1) = -z.imag();
      dynamics(row + 1, row) = z.imag();
      entry[row] = (1.0 - z).real();
      entry[row + 1] = (1.0 - z).imag();
    } else {
      entry[row] = (1.0 - z).real();
    }
    row += size_of(pole);
  }
  put_modes(columns, column, poles);
  put_common(columns, column);
  const VectorXd solution = least_squares(columns);
  const MatrixXd moved = dynamics + entry * solution.head(order).transpose();
  const Eigen::VectorXcd zeros = moved.eigenvalues();
  std::vector<Complex> next;
  for (Index i = 0; i < zeros.size(); ++i) {
    Complex z = zeros[i];
    if (std::abs(z) > 1.0) z = 1.0 / std::conj(z);
    if (std::abs(z.imag()) < 1e-12) {
      // Faster than a tick, or of alternating sign: no mode of a held plant.
      const double decay = std::clamp(z.real(), 1e-3, 1.0 - 1e-9);
      next.emplace_back(std::log(decay) / period_s_, 0.0);
    } else if (z.imag() > 0.0) {
      if (std::abs(z) < 1e-3) z *= 1e-3 / std::abs(z);
      next.push_back(std::log(z) / period_s_);
    }
  }
  return next;
}

MatrixXd MotionProblem::counted_rows(const MatrixXd& columns) const {
  const Index rows = ticks() - first_;
  return present_.tail(rows).asDiagonal() * columns.bottomRows(rows);
}

VectorXd MotionProblem::counted_output() const {
  return output_.cwiseProduct(present_).tail(ticks() - first_);
}

void MotionProblem::put_modes(MatrixXd& columns, Index& column,
                              const std::vector<Complex>& poles) const {
  const Eigen::VectorXcd drive = input_.cast<Complex>();
  for (const Complex& pole : poles) {
    const Complex z = std::exp(pole * period_s_);
    put(columns, column, filtered(z, 1.0 - z, drive), pole);
    put(columns, column, free_motion(z, ticks()), pole);
  }
}

void MotionProblem::put_common(MatrixXd& columns, Index& column) const {
  for (int delay = 0; delay <= settings_.most_delay_ticks; ++delay) {
    columns.col(column).setZero();
    columns.col(column).tail(ticks() - delay) = input_.head(ticks() - delay);
    ++column;
  }
  columns.col(column++).setOnes();
}

void MotionProblem::put_derivatives(MatrixXd& columns, Index& column,
                                    const std::vector<Complex>& poles,
                                    const VectorXd& solution) const {
  const Eigen::VectorXcd drive = input_.cast<Complex>();
  Index at = 0;
  for (const Complex& pole : poles) {
    const Complex z = std::exp(pole * period_s_);
    const Complex forced{solution[at], is_real(pole) ? 0.0 : -solution[at + 1]};
    const Index free_at = at + size_of(pole);
    const Complex free{solution[free_at], is_real(pole) ? 0.0 : -solution[free_at + 1]};
    const Eigen::VectorXcd x = filtered(z, 1.0 - z, drive);
    // d/ds of x: its recursion differentiated, dz/ds = T z.
    const Complex slope = period_s_ * z;
    const Eigen::VectorXcd change = filtered(z, slope, x) - filtered(z, slope, drive);
    Eigen::VectorXcd derivative = forced * change;
    Complex decay = 1.0;
    for (Index k = 0; k < ticks(); ++k) {
      derivative[k] += free * (static_cast<double>(k) * period_s_) * decay;
      decay *= z;
    }
    columns.col(column++) = derivative.real();
    if (!is_real(pole)) columns.col(column++) = -derivative.imag();
    at += 2 * size_of(pole);
  }
}

VectorXd MotionProblem::least_squares(const MatrixXd& columns) const {
  MatrixXd rows = counted_rows(columns);
  const VectorXd size = scale_columns(rows);
  const Eigen::ColPivHouseholderQR<MatrixXd> qr{rows};
  return size.cwiseInverse().cwiseProduct(VectorXd{qr.solve(counted_output())});
}

MotionFit MotionProblem::fit(const std::vector<Complex>& poles) const {
  const Index order = order_of(poles);
  const Index linear = 2 * order + common();
  MatrixXd columns(ticks(), linear + order);
  Index column = 0;
  put_modes(columns, column, poles);
  put_common(columns, column);
  const VectorXd solution = least_squares(columns.leftCols(linear));
  MotionFit fit{.poles = poles, .step = {}, .covariance = {}};
  fit.rss = (columns.leftCols(linear) * solution - output_)
                .cwiseProduct(present_)
                .tail(ticks() - first_)
                .squaredNorm();
  put_derivatives(columns, column, poles, solution);
  find_step(columns, fit);
  return fit;
}

void MotionProblem::find_step(const MatrixXd& columns, MotionFit& fit) const {
  const Index order = order_of(fit.poles);
  const Index linear = columns.cols() - order;
  MatrixXd rows = counted_rows(columns);
  const VectorXd size = scale_columns(rows).tail(order);
  const Eigen::HouseholderQR<MatrixXd> qr{rows};
  VectorXd wanted = (qr.householderQ().transpose() * counted_output()).segment(linear, order);
  // The poles are the last columns: their corner of R is all that is needed.
  MatrixXd r = qr.matrixQR().block(linear, linear, order, order).triangularView<Eigen::Upper>();
  std::vector<Index> undetermined;
  for (Index i = 0; i < order; ++i) {
    if (std::abs(r(i, i)) > least_pivot) continue;
    // An integrator looks like the constant: its pole stays where it is.
    undetermined.push_back(i);
    r.row(i).setZero();
    r.col(i).setZero();
    r(i, i) = 1.0;
    wanted[i] = 0.0;
  }
  const MatrixXd inverse = r.triangularView<Eigen::Upper>().solve(MatrixXd::Identity(order, order));
  fit.step = size.cwiseInverse().cwiseProduct(VectorXd{inverse * wanted});
  fit.covariance = size.cwiseInverse().asDiagonal() * (inverse * inverse.transpose()) *
                   size.cwiseInverse().asDiagonal();
  for (const Index i : undetermined) {
    fit.covariance(i, i) = std::numeric_limits<double>::infinity();
  }
}

MotionFit MotionProblem::refined(const std::vector<Complex>& poles) const {
  MotionFit best = fit(poles);
  for (int step = 0; step < most_refinements; ++step) {
    double scale = 1.0;
    MotionFit next;
    for (int halving = 0; halving < 5; ++halving, scale *= 0.4) {
      next = fit(moved(best.poles, best.step, scale));
      if (next.rss < best.rss) break;
    }
    if (!(next.rss < best.rss)) break;
    const bool done = best.rss - next.rss < 1e-4 * best.rss / samples() * 10.0;
    best = std::move(next);
    if (done) break;
  }
  return best;
}

}  // namespace sinerig::identify
