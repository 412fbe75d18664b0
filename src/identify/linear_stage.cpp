#include "identify/linear_stage.h"

#include <algorithm>

#include <Eigen/QR>

#include "identify/orthonormal_basis.h"

namespace sinerig::identify {

namespace {

using Eigen::ArrayXcd;
using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Inverse iteration on R'R: three rounds suffice, because the vector only seeds the next iterate.
VectorXd smallest_right_singular_vector(MatrixXd R) {
  const double tiny = std::max(R.cwiseAbs().maxCoeff() * 1e-15, 1e-100);
  for (Index i = 0; i < R.rows(); ++i)
    if (std::abs(R(i, i)) < tiny) R(i, i) = tiny;
  VectorXd v = VectorXd::Ones(R.cols());
  for (int round = 0; round < 3; ++round) {
    R.transpose().triangularView<Eigen::Lower>().solveInPlace(v);
    v /= v.norm();
    R.triangularView<Eigen::Upper>().solveInPlace(v);
    v /= v.norm();
  }
  return v;
}

// Q'A and A − Q(Q'A) for the basis of N: even polynomials live in the real rows only, odd ones in
// the imaginary rows.
struct NumeratorProjection {
  MatrixXd even, odd;

  NumeratorProjection(const OrthonormalBasis& basis, const ArrayXd& weight) {
    const Index terms = basis.degree() + 1;
    even.resize(weight.size(), (terms + 1) / 2);
    odd.resize(weight.size(), terms / 2);
    for (Index k = 0; k < terms; ++k)
      (k % 2 == 0 ? even : odd).col(k / 2) = (basis.factor().col(k).array() * weight).matrix();
  }

  VectorXd coefficients(const ArrayXcd& values) const {
    VectorXd n(even.cols() + odd.cols());
    const VectorXd n_even = even.transpose() * values.real().matrix();
    const VectorXd n_odd = odd.transpose() * values.imag().matrix();
    for (Index k = 0; k < n.size(); ++k) n[k] = k % 2 == 0 ? n_even[k / 2] : n_odd[k / 2];
    return n;
  }

  void remove_from(MatrixXd& stacked) const {
    const Index g = even.rows();
    const MatrixXd on_even = even.transpose() * stacked.topRows(g);
    const MatrixXd on_odd = odd.transpose() * stacked.bottomRows(g);
    stacked.topRows(g).noalias() -= even * on_even;
    stacked.bottomRows(g).noalias() -= odd * on_odd;
  }
};

double true_cost(const FitData& data, double delay_s, const GridRational& rational) {
  ArrayXcd model = data.known * rational.N / rational.D;
  if (delay_s != 0.0)
    for (Index i = 0; i < model.size(); ++i) model[i] *= std::polar(1.0, -data.omega[i] * delay_s);
  const double cost = whitened(data, model).squaredNorm();
  return std::isfinite(cost) ? cost : std::numeric_limits<double>::infinity();
}

}  // namespace

ArrayXd safe_magnitude(const ArrayXcd& D) {
  const ArrayXd magnitude = D.abs();
  return magnitude.max(std::max(magnitude.maxCoeff() * 1e-200, 1e-290));
}

GridRational linear_iterate(const FitData& data, double delay_s, const ArrayXd& D_prev,
                            Degrees degrees) {
  const ArrayXcd g = data.reduced(delay_s);
  const ArrayXd D_weight = (data.sigma * D_prev).inverse();
  const ArrayXd N_weight = D_weight / g.abs();
  const OrthonormalBasis D_basis(data.x, D_weight, degrees.denominator);
  const OrthonormalBasis N_basis(data.x, N_weight, degrees.numerator);
  const NumeratorProjection projection(N_basis, N_weight);

  const Index points = data.points();
  const ArrayXcd rotation = g * N_weight;
  MatrixXd residual(2 * points, degrees.denominator + 1);
  for (Index k = 0; k <= degrees.denominator; ++k) {
    const auto P = D_basis.factor().col(k).array();
    auto column = residual.col(k).array();
    if (k % 2 == 0) {
      column.head(points) = P * rotation.real();
      column.tail(points) = P * rotation.imag();
    } else {
      column.head(points) = -P * rotation.imag();
      column.tail(points) = P * rotation.real();
    }
  }
  projection.remove_from(residual);
  const Index columns = residual.cols();
  const MatrixXd R = residual.householderQr().matrixQR().topRows(columns);
  const VectorXd d = smallest_right_singular_vector(R);

  GridRational rational;
  rational.delay_s = delay_s;
  rational.D = D_basis.on_grid(d);
  rational.N = N_basis.on_grid(projection.coefficients(rotation * rational.D));
  rational.normalise();
  rational.cost = true_cost(data, delay_s, rational);
  return rational;
}

GridRational numerator_for(const FitData& data, double delay_s, const ArrayXcd& D,
                           int numerator_degree) {
  const ArrayXcd g = data.reduced(delay_s);
  const ArrayXd N_weight = (data.sigma * safe_magnitude(D) * g.abs()).inverse();
  const OrthonormalBasis N_basis(data.x, N_weight, numerator_degree);
  const NumeratorProjection projection(N_basis, N_weight);
  GridRational rational;
  rational.delay_s = delay_s;
  rational.D = D;
  rational.N = N_basis.on_grid(projection.coefficients(g * D * N_weight));
  rational.cost = true_cost(data, delay_s, rational);
  return rational;
}

}  // namespace sinerig::identify
