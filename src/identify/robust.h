// Fitting with a few gross outliers among the points.
#pragma once

#include <optional>
#include <vector>

#include "identify/search.h"

namespace sinerig::identify {

struct RobustFit {
  Refined refined;                     // on the points kept
  std::vector<Eigen::Index> kept;      // their indices, ascending
  std::vector<Eigen::Index> outliers;  // the others
};

// Squared size of each point's whitened residual.
Eigen::ArrayXd squared_residuals(const FitData& data, const Eigen::VectorXd& residual);

// True when a residual is larger than one point in a thousand responses would show: against the
// scatter where it is known, otherwise against the median residual.
bool outliers_suspected(const FitData& data, const Eigen::VectorXd& residual);

// Iteratively reweighted linear stages, first with bounded then with redescending influence, ranked
// by the sum of the smallest 85 % of the squared residuals; then refinement on the points inside
// the threshold until that set stays the same.
// Empty when the result is no outlier problem: more than 15 % rejected, three neighbours in a row
// rejected (a feature the model lacks), or the points kept not explained by their noise.
std::optional<RobustFit> fit_robustly(const FitData& data, const Freedom& freedom);

}  // namespace sinerig::identify
