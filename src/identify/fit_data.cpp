#include "identify/fit_data.h"

#include <cmath>

namespace sinerig::identify {

using Eigen::ArrayXcd;
using Eigen::ArrayXd;
using Eigen::Index;

ArrayXcd FitData::reduced(double delay_s) const {
  ArrayXcd g = H / known;
  if (delay_s != 0.0)
    for (Index i = 0; i < points(); ++i) g[i] *= std::polar(1.0, omega[i] * delay_s);
  return g;
}

FitData FitData::trusted(const ArrayXd& trust) const {
  FitData weighted = *this;
  const ArrayXd root = trust.sqrt();
  weighted.sigma /= root;
  weighted.w_rr *= root;
  weighted.w_ir *= root;
  weighted.w_ii *= root;
  return weighted;
}

FitData FitData::relative_to(const ArrayXcd& model) const {
  FitData weighted = *this;
  const ArrayXd ratio = H.abs() / model.abs();
  weighted.w_rr *= ratio;
  weighted.w_ir *= ratio;
  weighted.w_ii *= ratio;
  return weighted;
}

FitData FitData::subset(const std::vector<Index>& chosen) const {
  FitData part = *this;
  part.omega = omega(chosen).eval();
  part.x = x(chosen).eval();
  part.H = H(chosen).eval();
  part.known = known(chosen).eval();
  part.sigma = sigma(chosen).eval();
  part.w_rr = w_rr(chosen).eval();
  part.w_ir = w_ir(chosen).eval();
  part.w_ii = w_ii(chosen).eval();
  return part;
}

FitData make_fit_data(const Response& response, double model_error) {
  const auto g = static_cast<Index>(response.size());
  FitData data;
  data.scatter_known = has_scatter(response) || model_error > 0.0;
  data.scale = std::sqrt(response.front().omega_rad_s) * std::sqrt(response.back().omega_rad_s);
  for (ArrayXd* array : {&data.omega, &data.x, &data.sigma, &data.w_rr, &data.w_ir, &data.w_ii})
    array->resize(g);
  data.H.resize(g);
  data.known = ArrayXcd::Ones(g);
  for (Index i = 0; i < g; ++i) {
    const ResponsePoint& point = response[static_cast<std::size_t>(i)];
    const double magnitude = std::abs(point.response);
    data.omega[i] = point.omega_rad_s;
    data.x[i] = point.omega_rad_s / data.scale;
    data.H[i] = point.response;
    const double squared = magnitude * magnitude;
    const double floor = model_error * model_error;
    double variance_re = data.scatter_known ? point.variance_re / squared + floor : 1.0;
    double variance_im = data.scatter_known ? point.variance_im / squared + floor : 1.0;
    const double covariance = data.scatter_known ? point.covariance / squared : 0.0;
    const double l_rr = std::sqrt(variance_re);
    const double l_ir = covariance / l_rr;
    // A covariance of rank one would weigh one direction infinitely.
    const double l_ii = std::sqrt(std::max(variance_im - l_ir * l_ir, 1e-12 * variance_im));
    data.w_rr[i] = 1.0 / (l_rr * magnitude);
    data.w_ir[i] = -l_ir / (l_rr * l_ii * magnitude);
    data.w_ii[i] = 1.0 / (l_ii * magnitude);
    data.sigma[i] = std::sqrt(0.5 * (variance_re + variance_im));
  }
  // Files carry five digits or more.
  data.scatter_relative = data.sigma.maxCoeff() <= data.sigma.minCoeff() * (1.0 + 2e-4);
  return data;
}

void GridRational::normalise() {
  const double size = std::exp(D.abs().max(1e-300).log().mean());
  N /= size;
  D /= size;
}

Eigen::VectorXd whitened(const FitData& data, const ArrayXcd& model) {
  const Index g = data.points();
  const ArrayXd re = model.real() - data.H.real();
  const ArrayXd im = model.imag() - data.H.imag();
  Eigen::VectorXd residual(2 * g);
  residual.head(g) = (data.w_rr * re).matrix();
  residual.tail(g) = (data.w_ir * re + data.w_ii * im).matrix();
  return residual;
}

}  // namespace sinerig::identify
