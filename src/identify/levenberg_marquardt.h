// Nonlinear refinement of a rational model with delay.
#pragma once

#include "identify/fit_data.h"
#include "identify/local_model.h"

namespace sinerig::identify {

struct Refined {
  GridRational rational;  // with its cost and delay
  int iterations = 0;     // accepted and refused steps
  bool converged = false;
};

// Levenberg–Marquardt on the whitened residuals from a start, the bases renewed as D moves.
// Ends when the predicted decrease is below 1e-9 of the cost, or when no step decreases it any more
// (rounding), or, not converged, at most_iterations.
Refined refine(const FitData& data, const Freedom& freedom, const GridRational& start,
               int most_iterations = 60);

}  // namespace sinerig::identify
