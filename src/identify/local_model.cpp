#include "identify/local_model.h"

#include <algorithm>
#include <limits>

#include "identify/hold_model.h"

namespace sinerig::identify {

namespace {

using Complex = std::complex<double>;
using Eigen::ArrayXcd;
using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Projection of values that are a polynomial of the basis' degree onto the basis.
VectorXd coefficients_of(const OrthonormalBasis& basis, const ArrayXd& weight,
                         const ArrayXcd& values) {
  const ArrayXd squared = weight.square();
  VectorXd coefficients(basis.degree() + 1);
  for (Index k = 0; k < coefficients.size(); ++k) {
    const auto P = basis.factor().col(k).array();
    coefficients[k] =
        k % 2 == 0 ? (squared * P * values.real()).sum() : (squared * P * values.imag()).sum();
  }
  return coefficients;
}

ArrayXd denominator_weight(const FitData& data, const GridRational& at) {
  return (data.sigma * safe_magnitude(at.D)).inverse();
}

ArrayXd numerator_weight(const FitData& data, const GridRational& at) {
  return denominator_weight(data, at) * data.known.abs() / data.H.abs();
}

// How a complex sensitivity z times a real factor, or times j and a real factor, reaches the rows.
struct Whitening {
  ArrayXd top_real, bottom_real, top_turned, bottom_turned;
  Whitening(const FitData& data, const ArrayXcd& z)
      : top_real(data.w_rr * z.real()),
        bottom_real(data.w_ir * z.real() + data.w_ii * z.imag()),
        top_turned(-data.w_rr * z.imag()),
        bottom_turned(data.w_ii * z.real() - data.w_ir * z.imag()) {}
};

}  // namespace

LocalModel::LocalModel(const FitData& data, const Freedom& freedom, const GridRational& at)
    : data_(data),
      freedom_(freedom),
      D_basis_(data.x, denominator_weight(data, at), freedom.degrees.denominator),
      N_basis_(data.x, numerator_weight(data, at), freedom.degrees.numerator) {
  parameters_.delay_s = at.delay_s;
  parameters_.d = coefficients_of(D_basis_, denominator_weight(data, at), at.D);
  parameters_.n = coefficients_of(N_basis_, numerator_weight(data, at), at.N);
  const double size = parameters_.d.norm();
  parameters_.d /= size;
  parameters_.n /= size;
  parameters_.d.cwiseAbs().maxCoeff(&gauge_);
  if (freedom_.static_ratio) {
    N_at_zero_ = N_basis_.all_at(0.0).real();
    D_at_zero_ = D_basis_.all_at(0.0).real();
    N_at_zero_.cwiseAbs().maxCoeff(&dependent_);
    parameters_ = stepped(VectorXd::Zero(freedom_.parameters()));
  }
}

int LocalModel::numerator_column(int k) const {
  if (k == dependent_) return -1;
  return dependent_ >= 0 && k > dependent_ ? k - 1 : k;
}

int LocalModel::free_numerators() const {
  return freedom_.degrees.numerator + (dependent_ >= 0 ? 0 : 1);
}

int LocalModel::denominator_column(int k) const {
  if (k == gauge_) return -1;
  return free_numerators() + (k > gauge_ ? k - 1 : k);
}

LocalModel::Parameters LocalModel::stepped(const VectorXd& step) const {
  Parameters next = parameters_;
  for (int k = 0; k <= freedom_.degrees.numerator; ++k)
    if (numerator_column(k) >= 0) next.n[k] += step[numerator_column(k)];
  for (int k = 0; k <= freedom_.degrees.denominator; ++k)
    if (denominator_column(k) >= 0) next.d[k] += step[denominator_column(k)];
  if (dependent_ >= 0) {
    next.n[dependent_] = 0.0;
    const double wanted = *freedom_.static_ratio * D_at_zero_.dot(next.d);
    next.n[dependent_] = (wanted - N_at_zero_.dot(next.n)) / N_at_zero_[dependent_];
  }
  if (freedom_.delay)
    next.delay_s = std::clamp(next.delay_s + step[step.size() - 1] / data_.scale,
                              freedom_.least_delay_s, freedom_.largest_delay_s);
  return next;
}

ArrayXcd LocalModel::response(const Parameters& parameters) const {
  if (freedom_.hold)
    return freedom_.hold->response(N_basis_, parameters.n, D_basis_, parameters.d,
                                   parameters.delay_s, data_);
  ArrayXcd model = data_.known * N_basis_.on_grid(parameters.n) / D_basis_.on_grid(parameters.d);
  if (parameters.delay_s != 0.0)
    for (Index i = 0; i < model.size(); ++i)
      model[i] *= std::polar(1.0, -data_.omega[i] * parameters.delay_s);
  return model;
}

bool LocalModel::roots_allowed(const Parameters& parameters) const {
  const auto left = [](Complex root) {
    return root.real() < 0.0;
  };
  if (freedom_.stable_poles) {
    const auto poles = D_basis_.roots(parameters.d);
    if (!std::all_of(poles.begin(), poles.end(), left)) return false;
  }
  if (freedom_.stable_zeros) {
    const auto zeros = N_basis_.roots(parameters.n);
    if (!std::all_of(zeros.begin(), zeros.end(), left)) return false;
  }
  return true;
}

VectorXd LocalModel::residual(const Parameters& parameters) const {
  if (!roots_allowed(parameters))
    return VectorXd::Constant(2 * data_.points(), std::numeric_limits<double>::infinity());
  return whitened(data_, response(parameters));
}

MatrixXd LocalModel::jacobian() const {
  const Index g = data_.points();
  if (freedom_.hold) {
    const auto held = freedom_.hold->sensitivity(N_basis_, parameters_.n, D_basis_, parameters_.d,
                                                 parameters_.delay_s, data_);
    if (held) {
      MatrixXd full(2 * g, held->cols());
      full.topRows(g) = data_.w_rr.matrix().asDiagonal() * held->real();
      full.bottomRows(g) = data_.w_ir.matrix().asDiagonal() * held->real();
      full.bottomRows(g) += data_.w_ii.matrix().asDiagonal() * held->imag();
      return full * spread_to_full();
    }
  }
  const ArrayXcd D = D_basis_.on_grid(parameters_.d);
  const ArrayXcd model = response(parameters_);
  ArrayXcd by_N = data_.known / D;
  if (parameters_.delay_s != 0.0)
    for (Index i = 0; i < g; ++i) by_N[i] *= std::polar(1.0, -data_.omega[i] * parameters_.delay_s);
  if (freedom_.hold) by_N = model / N_basis_.on_grid(parameters_.n);
  const Whitening N_rows(data_, by_N);
  const Whitening D_rows(data_, -model / D);

  MatrixXd J(2 * g, freedom_.parameters());
  const auto fill = [g](auto column, const auto& P, const Whitening& rows, int k) {
    if (k % 2 == 0) {
      column.head(g) = rows.top_real * P;
      column.tail(g) = rows.bottom_real * P;
    } else {
      column.head(g) = rows.top_turned * P;
      column.tail(g) = rows.bottom_turned * P;
    }
  };
  ArrayXd dependent(2 * g);
  if (dependent_ >= 0)
    fill(dependent.head(2 * g), N_basis_.factor().col(dependent_).array(), N_rows, dependent_);
  for (int k = 0; k <= freedom_.degrees.numerator; ++k) {
    const int column = numerator_column(k);
    if (column < 0) continue;
    fill(J.col(column).array(), N_basis_.factor().col(k).array(), N_rows, k);
    if (dependent_ >= 0)
      J.col(column) -= dependent.matrix() * (N_at_zero_[k] / N_at_zero_[dependent_]);
  }
  for (int k = 0; k <= freedom_.degrees.denominator; ++k) {
    const int column = denominator_column(k);
    if (column < 0) continue;
    fill(J.col(column).array(), D_basis_.factor().col(k).array(), D_rows, k);
    if (dependent_ >= 0)
      J.col(column) +=
          dependent.matrix() * (*freedom_.static_ratio * D_at_zero_[k] / N_at_zero_[dependent_]);
  }
  if (freedom_.delay) {
    const Whitening delay_rows(data_, -model * data_.x);
    fill(J.col(J.cols() - 1).array(), ArrayXd::Ones(g), delay_rows, 1);
  }
  if (freedom_.hold) add_hold_sensitivity(J);
  return J;
}

// The images of a held response move with the parameters too; the columns above have only the part
// of the plain response, so the exact ones replace them, by central differences: for poles that are
// too close for their sensitivity in closed form.
void LocalModel::add_hold_sensitivity(MatrixXd& J) const {
  // With columns of size one, the rounding of the residual (1e-13 of its scale) over the step and
  // the curvature times the step squared balance near 1e-4. The scale is that of H over its
  // scatter.
  constexpr double relative_step = 1e-4;
  VectorXd step = VectorXd::Zero(J.cols());
  for (Index column = 0; column < J.cols(); ++column) {
    const double size = std::max(J.col(column).norm(), 1e-300);
    const double width =
        relative_step / size * std::sqrt(static_cast<double>(J.rows())) / data_.sigma.maxCoeff();
    const auto at = [&](double signed_width) {
      VectorXd one = step;
      one[column] = signed_width;
      return whitened(data_, response(stepped(one)));
    };
    const VectorXd exact = (at(width) - at(-width)) / (2.0 * width);
    // The hold takes a delay within 1e-9 of whole ticks as whole: a step within that moves nothing.
    if (exact.allFinite() && exact.norm() > 0.0) J.col(column) = exact;
  }
}

MatrixXd LocalModel::spread_to_full() const {
  const Index n_terms = parameters_.n.size();
  const Index d_terms = parameters_.d.size();
  MatrixXd spread = MatrixXd::Zero(n_terms + d_terms + 1, freedom_.parameters());
  for (int k = 0; k < n_terms; ++k)
    if (numerator_column(k) >= 0) spread(k, numerator_column(k)) = 1.0;
  for (int k = 0; k < d_terms; ++k)
    if (denominator_column(k) >= 0) spread(n_terms + k, denominator_column(k)) = 1.0;
  if (dependent_ >= 0) {
    for (int k = 0; k < n_terms; ++k)
      if (numerator_column(k) >= 0)
        spread(dependent_, numerator_column(k)) = -N_at_zero_[k] / N_at_zero_[dependent_];
    for (int k = 0; k < d_terms; ++k)
      if (denominator_column(k) >= 0)
        spread(dependent_, denominator_column(k)) =
            *freedom_.static_ratio * D_at_zero_[k] / N_at_zero_[dependent_];
  }
  if (freedom_.delay) spread(n_terms + d_terms, freedom_.parameters() - 1) = 1.0;
  return spread;
}

GridRational LocalModel::on_grid() const {
  GridRational rational;
  rational.N = N_basis_.on_grid(parameters_.n);
  rational.D = D_basis_.on_grid(parameters_.d);
  rational.delay_s = parameters_.delay_s;
  rational.normalise();
  return rational;
}

}  // namespace sinerig::identify
