// A measured response prepared for fitting: scaled frequency, whitening, known factors.
#pragma once

#include <complex>
#include <vector>

#include <Eigen/Core>

#include "identify/response.h"

namespace sinerig::identify {

// All arrays have one entry per point. The model is known · N(jx)/D(jx) · exp(−jω·delay).
struct FitData {
  Eigen::ArrayXd omega;   // rad/s
  Eigen::ArrayXd x;       // ω / scale
  double scale = 1.0;     // rad/s, the geometric mean of the first and the last frequency
  Eigen::ArrayXcd H;      // measured
  Eigen::ArrayXcd known;  // factors that are not fitted: s^−k, given poles, known delay, hold
  Eigen::ArrayXd sigma;   // relative standard deviation of each of re and im, for the linear stage
  // Whitened residual of e = model − H: (w_rr·re e, w_ir·re e + w_ii·im e), unit covariance.
  Eigen::ArrayXd w_rr, w_ir, w_ii;
  bool scatter_known = false;  // otherwise sigma is 1 and only ratios of χ² mean something
  // The scatter is the same fraction of the measured magnitude everywhere, or unknown: it speaks of
  // a relative error, and weights by the noisy measured magnitude would bias the gain by 2σ².
  bool scatter_relative = false;

  Eigen::Index points() const { return omega.size(); }
  // The response left for N/D when the delay is taken out.
  Eigen::ArrayXcd reduced(double delay_s) const;
  // The same with each point counted trust_i times (0 … 1): residuals shrink by its square root.
  FitData trusted(const Eigen::ArrayXd& trust) const;
  // Where the scatter is relative: the same fraction of the model's magnitude instead.
  FitData relative_to(const Eigen::ArrayXcd& model) const;
  // The points named, in order.
  FitData subset(const std::vector<Eigen::Index>& points) const;
};

// model_error adds a floor to the scatter: a relative standard deviation, added in quadrature.
// Above zero it is the scatter of a response that has none.
FitData make_fit_data(const Response& response, double model_error);

// Polynomials N and D by their values on the grid: exact to convert to any basis of their degree.
struct GridRational {
  Eigen::ArrayXcd N;
  Eigen::ArrayXcd D;
  double cost = 0.0;  // Σ |whitened residual|² with the delay it was made for
  double delay_s = 0.0;

  // Divides N and D by the geometric mean of |D|: iterates shrink by σ each, and would underflow.
  void normalise();
};

// Whitened residuals of a model on the grid: real parts over imaginary parts.
Eigen::VectorXd whitened(const FitData& data, const Eigen::ArrayXcd& model);

}  // namespace sinerig::identify
