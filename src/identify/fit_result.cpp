#include "identify/fit_result.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/QR>
#include <Eigen/SVD>

#include "identify/parameter_covariance.h"

namespace sinerig::identify {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Quantile of χ² after Wilson and Hilferty; z standard deviations of a normal variable.
double chi2_quantile(int degrees_of_freedom, double z) {
  if (degrees_of_freedom < 1) return 0.0;
  const double ninth = 2.0 / (9.0 * degrees_of_freedom);
  const double root = std::max(0.0, 1.0 - ninth + z * std::sqrt(ninth));
  return degrees_of_freedom * root * root * root;
}

struct Linearised {
  MatrixXd factor;  // of the covariance of the free parameters for unit noise: factor·factor'
  double condition;
};

Linearised linearise(const MatrixXd& J) {
  const Index parameters = J.cols();
  if (parameters == 0) return {MatrixXd(0, 0), 1.0};  // everything given
  const VectorXd size = J.colwise().norm().cwiseMax(1e-300);
  const MatrixXd scaled = J * size.cwiseInverse().asDiagonal();
  MatrixXd R = scaled.householderQr().matrixQR().topRows(parameters).triangularView<Eigen::Upper>();
  const VectorXd singular = Eigen::BDCSVD<MatrixXd>(R).singularValues();
  for (Index i = 0; i < parameters; ++i)
    if (std::abs(R(i, i)) < 1e-15) R(i, i) = 1e-15;
  const MatrixXd inverse =
      R.triangularView<Eigen::Upper>().solve(MatrixXd::Identity(parameters, parameters));
  return {size.cwiseInverse().asDiagonal() * inverse, singular[0] / singular[parameters - 1]};
}

// Unit noise of the whitened residual as it reaches the residual weighted otherwise.
Linearised linearise(const MatrixXd& J, const FitData& white, const FitData& weighted) {
  const Index g = white.points();
  const Linearised inverse = linearise(J);
  const MatrixXd pseudo = inverse.factor * (inverse.factor.transpose() * J.transpose());
  // e = (top, bottom)/whitening, weighted without correlation.
  const Eigen::ArrayXd top = weighted.w_rr / white.w_rr;
  const Eigen::ArrayXd across = -weighted.w_ii * white.w_ir / (white.w_rr * white.w_ii);
  const Eigen::ArrayXd bottom = weighted.w_ii / white.w_ii;
  MatrixXd reached(pseudo.rows(), 2 * g);
  reached.leftCols(g) = pseudo.leftCols(g) * top.matrix().asDiagonal();
  reached.leftCols(g) += pseudo.rightCols(g) * across.matrix().asDiagonal();
  reached.rightCols(g) = pseudo.rightCols(g) * bottom.matrix().asDiagonal();
  return {reached, inverse.condition};
}

std::vector<double> root_diagonal(const MatrixXd& covariance, Index first, std::size_t count) {
  std::vector<double> errors;
  for (std::size_t i = 0; i < count; ++i)
    errors.push_back(std::sqrt(covariance.diagonal()[first + static_cast<Index>(i)]));
  return errors;
}

void describe_roots(const ParameterCovariance& parameters, Fit& fit) {
  for (const auto pole : fit.zpk.poles) {
    fit.poles.push_back(parameters.pole(pole));
    if (pole != 0.0 && pole.imag() >= 0.0) fit.modes.push_back(parameters.mode(pole));
  }
  for (const auto zero : fit.zpk.zeros) fit.zeros.push_back(parameters.zero(zero));
  std::sort(fit.modes.begin(), fit.modes.end(), [](const Mode& a, const Mode& b) {
    return a.frequency_hz.value < b.frequency_hz.value;
  });
}

Fit describe(const FitSetup& setup, const FitData& data, const Refined& refined,
             const LocalModel& model, const Linearised& linearised) {
  Fit fit;
  fit.scatter_known = data.scatter_known;
  fit.chi2 = refined.rational.cost;
  fit.free_parameters = setup.freedom.parameters();
  fit.degrees_of_freedom = static_cast<int>(2 * data.points()) - fit.free_parameters;
  fit.chi2_low = chi2_quantile(fit.degrees_of_freedom, -1.959964);
  fit.chi2_high = chi2_quantile(fit.degrees_of_freedom, 1.959964);
  fit.condition = linearised.condition;
  fit.iterations = refined.iterations;
  fit.converged = refined.converged;
  fit.reason = refined.converged
                   ? "no step lowers chi2 any further"
                   : "the limit of iterations was reached; the orders may be too high";
  const double variance =
      data.scatter_known || fit.degrees_of_freedom < 1 ? 1.0 : fit.chi2 / fit.degrees_of_freedom;
  const MatrixXd factor = std::sqrt(variance) * model.spread_to_full() * linearised.factor;
  const auto parameters = std::make_shared<const ParameterCovariance>(
      model.N_basis(), model.D_basis(), model.parameters().n, model.parameters().d, data.scale,
      model.parameters().delay_s, setup.fixed, factor);
  fit.parameters = parameters;
  fit.zpk = parameters->zpk();
  fit.model = to_transfer_function(fit.zpk);
  fit.covariance = parameters->of_coefficients();
  fit.num_standard_error = root_diagonal(fit.covariance, 0, fit.model.num.size());
  fit.den_standard_error =
      root_diagonal(fit.covariance, static_cast<Index>(fit.model.num.size()), fit.model.den.size());
  fit.delay_s = parameters->delay();
  fit.static_gain = parameters->static_gain();
  fit.root_covariance = parameters->of_roots();
  describe_roots(*parameters, fit);
  return fit;
}

}  // namespace

Fit make_fit(const FitSetup& setup, const FitData& data, const Refined& refined,
             const std::vector<Index>& outliers) {
  const LocalModel model(data, setup.freedom, refined.rational);
  Fit fit = describe(setup, data, refined, model, linearise(model.jacobian()));
  for (const Index outlier : outliers) fit.outliers.push_back(static_cast<std::size_t>(outlier));
  return fit;
}

Fit make_weighted_fit(const FitSetup& setup, const Refined& refined, const Eigen::ArrayXd& weight) {
  FitData weighted = setup.data;
  weighted.w_rr = weighted.w_ii = weight / (setup.data.H.abs() * weight.mean());
  weighted.w_ir.setZero();
  const LocalModel model(weighted, setup.freedom, refined.rational);
  Fit fit = describe(setup, setup.data, refined, model,
                     linearise(model.jacobian(), setup.data, weighted));
  fit.reason = "the least squares are linear: one step is the solution";
  return fit;
}

}  // namespace sinerig::identify
