// The exact hold as part of a model whose polynomials are given in orthonormal bases.
#pragma once

#include <optional>

#include <Eigen/Core>

#include "identify/fit_data.h"
#include "identify/orthonormal_basis.h"
#include "identify/transfer_function.h"

namespace sinerig::identify {

// fixed · N(s/scale)/D(s/scale) · exp(−s·delay_s), as zeros, poles and gain in rad/s.
// fixed holds the factors that are not fitted; its delay adds.
ZerosPolesGain compose(const OrthonormalBasis& N_basis, const Eigen::VectorXd& n,
                       const OrthonormalBasis& D_basis, const Eigen::VectorXd& d, double scale,
                       double delay_s, const ZerosPolesGain& fixed);

class HoldModel {
 public:
  HoldModel(double period_s, const ZerosPolesGain& fixed) : period_s_(period_s), fixed_(fixed) {}
  Eigen::ArrayXcd response(const OrthonormalBasis& N_basis, const Eigen::VectorXd& n,
                           const OrthonormalBasis& D_basis, const Eigen::VectorXd& d,
                           double delay_s, const FitData& data) const;
  // Of that response by n, d and delay·scale, one column each. Nothing where two poles, or one and
  // the origin, are so close that their partial fractions cancel.
  std::optional<Eigen::MatrixXcd> sensitivity(const OrthonormalBasis& N_basis,
                                              const Eigen::VectorXd& n,
                                              const OrthonormalBasis& D_basis,
                                              const Eigen::VectorXd& d, double delay_s,
                                              const FitData& data) const;

 private:
  double period_s_;
  ZerosPolesGain fixed_;
};

}  // namespace sinerig::identify
