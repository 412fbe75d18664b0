#include "identify/root_covariance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <Eigen/Eigenvalues>

namespace sinerig::identify {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Largest relative change of a root, gain or phase in a difference: the error of the difference,
// its square over the distance of neighbouring roots, stays below 1e-6 where rounding is 1e-10.
constexpr double difference_step = 1e-6;

Index coordinates_of(const std::vector<Complex>& roots) {
  Index count = 0;
  for (const Complex root : roots) count += root.imag() > 0.0 ? 2 : root.imag() == 0.0 ? 1 : 0;
  return count;
}

std::vector<Complex> moved(const std::vector<Complex>& roots, const VectorXd& step, Index& at) {
  std::vector<Complex> out = roots;
  std::vector<bool> followed(roots.size(), false);
  for (std::size_t i = 0; i < roots.size(); ++i) {
    if (roots[i].imag() < 0.0) continue;
    out[i] += step[at++];
    if (roots[i].imag() == 0.0) continue;
    out[i] += Complex{0.0, step[at++]};
    for (std::size_t j = 0; j < roots.size(); ++j) {
      if (followed[j] || roots[j] != std::conj(roots[i])) continue;
      out[j] = std::conj(out[i]);
      followed[j] = true;
      break;
    }
  }
  return out;
}

double log_magnitude(const ZerosPolesGain& model, double omega_rad_s) {
  return std::log(std::abs(model.at(omega_rad_s)));
}

void check(const ZerosPolesGain& model, const RootCovariance& covariance) {
  const Index wanted = coordinates_of(model);
  if (covariance.covariance.rows() != wanted || covariance.covariance.cols() != wanted)
    throw std::invalid_argument(
        "covariance: it has " + std::to_string(covariance.covariance.rows()) +
        " rows, the model has " + std::to_string(wanted) + " coordinates; fit again");
}

// d ln G(s) by the coordinates of the roots.
void add_roots(const std::vector<Complex>& roots, Complex s, double sign, Eigen::VectorXcd& row,
               Index& at) {
  for (const Complex root : roots) {
    if (root.imag() < 0.0) continue;
    const Complex above = sign / (s - root);
    if (root.imag() == 0.0) {
      row[at++] = above;
      continue;
    }
    const Complex below = sign / (s - std::conj(root));
    row[at++] = above + below;
    row[at++] = Complex{0.0, 1.0} * (above - below);
  }
}

Eigen::VectorXcd log_sensitivity(const ZerosPolesGain& model, double omega_rad_s) {
  const Complex s{0.0, omega_rad_s};
  Eigen::VectorXcd row = Eigen::VectorXcd::Zero(coordinates_of(model));
  Index at = 0;
  add_roots(model.poles, s, 1.0, row, at);
  add_roots(model.zeros, s, -1.0, row, at);
  row[at + 1] = -s;
  return row;
}

// Columns L with L·L' the covariance, along its principal directions.
MatrixXd factor_of(const MatrixXd& covariance) {
  const VectorXd size = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  const VectorXd inverse =
      size.unaryExpr([](double each) { return each > 0.0 ? 1.0 / each : 0.0; });
  const MatrixXd correlation = inverse.asDiagonal() * covariance * inverse.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> directions(correlation);
  const VectorXd lengths = directions.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  return size.asDiagonal() * directions.eigenvectors() * lengths.asDiagonal();
}

double largest_relative_change(const ZerosPolesGain& model, double reference_rad_s,
                               const VectorXd& step) {
  double largest =
      std::max(std::abs(step[step.size() - 2]), std::abs(step[step.size() - 1]) * reference_rad_s);
  Index at = 0;
  for (const auto* roots : {&model.poles, &model.zeros})
    for (const Complex root : *roots) {
      if (root.imag() < 0.0) continue;
      const double size = std::abs(root);
      for (int i = 0; i < (root.imag() > 0.0 ? 2 : 1); ++i, ++at)
        if (size > 0.0) largest = std::max(largest, std::abs(step[at]) / size);
    }
  return largest;
}

}  // namespace

Index coordinates_of(const ZerosPolesGain& model) {
  return coordinates_of(model.poles) + coordinates_of(model.zeros) + 2;
}

ZerosPolesGain moved(const ZerosPolesGain& model, double reference_rad_s, const VectorXd& step) {
  Index at = 0;
  ZerosPolesGain out = model;
  out.poles = moved(model.poles, step, at);
  out.zeros = moved(model.zeros, step, at);
  out.gain *= std::exp(log_magnitude(model, reference_rad_s) - log_magnitude(out, reference_rad_s) +
                       step[at]);
  out.delay_s += step[at + 1];
  return out;
}

ResponsePoint response_with_covariance(const ZerosPolesGain& model,
                                       const RootCovariance& covariance, double omega_rad_s) {
  check(model, covariance);
  Eigen::VectorXcd row = log_sensitivity(model, omega_rad_s);
  row -= log_sensitivity(model, covariance.reference_rad_s).real().cast<Complex>();
  row[row.size() - 2] = 1.0;
  const Complex G = model.at(omega_rad_s);
  const Eigen::VectorXcd dG = G * row;
  const VectorXd re = dG.real();
  const VectorXd im = dG.imag();
  const VectorXd carried = covariance.covariance * re;
  const double variance_re = re.dot(carried);
  const double variance_im = im.dot(covariance.covariance * im);
  // Roots that hardly show in the response have large variances that cancel in its own; what is
  // left of it below their rounding says nothing.
  const double terms = dG.cwiseAbs().dot(covariance.covariance.diagonal().cwiseAbs().cwiseSqrt());
  const double rounding = 4.0 * std::numeric_limits<double>::epsilon() * terms * terms;
  if (!(variance_re + variance_im >= rounding)) {
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    return {omega_rad_s, G, none, none, none};
  }
  return {omega_rad_s, G, std::max(variance_re, 0.0), im.dot(carried), std::max(variance_im, 0.0)};
}

std::vector<double> standard_errors(
    const ZerosPolesGain& model, const RootCovariance& covariance,
    const std::function<std::vector<double>(const ZerosPolesGain&)>& quantities) {
  check(model, covariance);
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> variance(quantities(model).size(), 0.0);
  const MatrixXd factor = factor_of(covariance.covariance);
  for (const auto& direction : factor.colwise()) {
    const double change = largest_relative_change(model, covariance.reference_rad_s, direction);
    if (change == 0.0) continue;
    // A covariance that is not finite says nothing, and no model can be moved along it.
    if (!std::isfinite(change)) return std::vector<double>(variance.size(), none);
    const double width = difference_step / change;
    std::vector<double> ahead;
    std::vector<double> behind;
    try {
      ahead = quantities(moved(model, covariance.reference_rad_s, width * direction));
      behind = quantities(moved(model, covariance.reference_rad_s, -width * direction));
    } catch (const std::invalid_argument&) {
      ahead.clear();
    }
    if (ahead.size() != variance.size() || behind.size() != variance.size())
      return std::vector<double>(variance.size(), none);
    for (std::size_t i = 0; i < variance.size(); ++i)
      variance[i] += std::pow((ahead[i] - behind[i]) / (2.0 * width), 2);
  }
  for (double& each : variance) each = std::sqrt(each);
  return variance;
}

}  // namespace sinerig::identify
