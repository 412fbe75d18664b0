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

}  // namespace sinerig::identify
