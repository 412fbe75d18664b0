// The result of a fit from the point where the search ended.
#pragma once

#include <vector>

#include "identify/fit.h"
#include "identify/fit_setup.h"
#include "identify/levenberg_marquardt.h"

namespace sinerig::identify {

// data: the points kept, weighted as they were at the end. outliers: indices of the others.
// The covariance is (J'J)⁻¹ of the whitened residual, times χ² per degree of freedom where the
// scatter is unknown.
Fit make_fit(const FitSetup& setup, const FitData& data, const Refined& refined,
             const std::vector<Eigen::Index>& outliers);

// The same for a model that minimises Σ (weight·relative error)² in place of χ², one weight per
// point: the covariance is that of such an estimate under the scatter of the points,
// J⁺·Λ·C·Λ·J⁺' with J the weighted Jacobian and C the covariance of the relative errors.
Fit make_weighted_fit(const FitSetup& setup, const Refined& refined, const Eigen::ArrayXd& weight);

}  // namespace sinerig::identify
