// The reweighted linear stage: a consistent (total least squares) estimate of N and D from a first
// guess of |D|, repeated (bootstrapped total least squares, Pintelon and Schoukens).
#pragma once

#include <Eigen/Core>

#include "identify/fit_data.h"

namespace sinerig::identify {

struct Degrees {
  int numerator = 0;
  int denominator = 1;
};

// One linear solution of N − D·g for g = data.reduced(delay_s), rows weighted by 1/(σ|g||D_prev|),
// under the constraint that the noise has unit norm, Σ|D|²/|D_prev|² = 1: in the orthonormal basis
// of D that is the smallest right singular vector once N is projected out.
// D_prev: |D| on the grid, positive. The result's cost is that of the true residual N/D − g.
GridRational linear_iterate(const FitData& data, double delay_s, const Eigen::ArrayXd& D_prev,
                            Degrees degrees);

// N that fits best for a given D.
GridRational numerator_for(const FitData& data, double delay_s, const Eigen::ArrayXcd& D,
                           int numerator_degree);

// |D| usable as a weight: only an exact zero is lifted. |D| of order 26 spans 100 decades over four
// of frequency; clipping it at 1e-14 of its largest value lost every plant from order 18 on.
Eigen::ArrayXd safe_magnitude(const Eigen::ArrayXcd& D);

}  // namespace sinerig::identify
