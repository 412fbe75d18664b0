// The covariance of a fitted model in the coordinates of its roots: enough to carry the errors over
// to the response anywhere and to any quantity computed from the model, and small enough to store.
#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>

#include "identify/response.h"
#include "identify/transfer_function.h"

namespace sinerig::identify {

// Coordinates, in this order: of each pole in the order of ZerosPolesGain::poles its real part and,
// where that is above zero, its imaginary part (a root below the axis has none: it follows its
// conjugate); the same of the zeros; ln|G(jω)| at reference_rad_s; delay_s.
// The gain is taken inside the band because there it is hardly correlated with roots far outside.
struct RootCovariance {
  double reference_rad_s = 1.0;
  Eigen::MatrixXd covariance;  // coordinates × coordinates

  bool known() const { return covariance.size() > 0; }
};

// Number of coordinates of a model.
Eigen::Index coordinates_of(const ZerosPolesGain& model);

// The model a step away in those coordinates; step: one value per coordinate.
ZerosPolesGain moved(const ZerosPolesGain& model, double reference_rad_s,
                     const Eigen::VectorXd& step);

// G(jω) with the covariance of (re, im), to first order; that is NaN where it is not finite, or
// below the rounding of the variances of roots that the response hardly shows. Throws
// std::invalid_argument when the covariance does not have the size that the model asks for.
ResponsePoint response_with_covariance(const ZerosPolesGain& model,
                                       const RootCovariance& covariance, double omega_rad_s);

// One sigma of each quantity, to first order: the delta method along the principal directions of
// the covariance, by central differences. NaN where a quantity does not exist on both sides of the
// model. Throws as response_with_covariance.
std::vector<double> standard_errors(
    const ZerosPolesGain& model, const RootCovariance& covariance,
    const std::function<std::vector<double>(const ZerosPolesGain&)>& quantities);

}  // namespace sinerig::identify
