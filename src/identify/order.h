// Order and structure chosen from the data.
#pragma once

#include <optional>
#include <vector>

#include "identify/fit.h"
#include "identify/response.h"

namespace sinerig::identify {

struct OrderSettings {
  // Everything but zeros, poles and origin; with Delay::fit a delay is always a parameter.
  FitOptions fit;
  int most_poles = 16;
  int most_origin = 2;           // poles at the origin tried: 0 … most_origin
  int most_relative_degree = 4;  // poles − zeros tried: 0 … this
  // Relative standard deviation that the points of a response without scatter are taken to have,
  // and the least of several times that by which some model explains them: the error that sweeps
  // are allowed for their order. 0: none.
  double assumed_scatter = 2e-3;
  // Parts that are known; the others are chosen.
  std::optional<int> zeros;
  std::optional<int> poles;
  std::optional<int> origin;
};

struct OrderCandidate {
  int zeros = 0;
  int poles = 0;
  int origin = 0;
  int parameters = 0;
  double chi2 = 0.0;
  double criterion = 0.0;  // what is minimised, see select_order
  bool explained = false;  // χ² is what noise alone leaves (scatter known)
  bool at_limit = false;   // a root is held on the edge of what stable or minimum_phase allows
};

struct OrderSelection {
  FitOptions chosen;
  Fit fit;
  std::vector<OrderCandidate> table;  // by rising criterion; the first is the one chosen
};

// First the lowest order whose most flexible structure (no pole at the origin, one zero less than
// poles) is explained by the scatter; then all structures of that order and the two above it.
// Criterion: χ² + p·(ln(2g) + 4) with known scatter (BIC and the price of many candidates, p free
// parameters, g points); where nothing is explained, or the scatter is unknown,
// 2g·ln(χ²/2g) + p·(ln(2g) + 4), the same with the noise unknown. χ² is that of the model with its
// hold and within its constraints; structures that only a constraint holds come last.
// Without scatter or a model error, settings.assumed_scatter stands in for it, unless nothing is
// explained by it or a model follows the points so closely that they were computed; the fit
// returned knows of no scatter. Real noise is uneven, and poles are a cheap way to follow the
// points where it is large: the noise unknown asked for 8 poles of a motor that has 3. Throws
// std::invalid_argument as fit_maximum_likelihood does, and when no order is possible.
OrderSelection select_order(const Response& response, const OrderSettings& settings);

}  // namespace sinerig::identify
