// A model of Hassul's least squares as a full fit: quality, roots and standard errors.
#pragma once

#include <vector>

#include "identify/fit.h"
#include "identify/hassul.h"
#include "identify/response.h"

namespace sinerig::identify {

// Describes what fit_hassul (or fit_choe) found for `orders` with `weights`, one per point. The
// equations' error B − A/V, V = 1/((jω)^k G), is B times the relative error of the model, so the
// estimate is one of least squares of weight·|B|·relative error; its covariance under the scatter
// of the points follows to first order (that noise in G biases it where m > 0 or the noise is
// large is not part of it). Where the scatter is unknown the relative residual stands in for it.
// options: the known delay, the path and the hold that `response` was measured through; its orders
// are not read. The model returned is monic; its coefficients are those of `model` exactly.
// Throws std::invalid_argument for weights, orders and points as fit_hassul does, and when the
// model is not finite on the grid.
Fit describe_least_squares(const Response& response, const FitOptions& options,
                           const HassulOrders& orders, const TransferFunction& model,
                           const std::vector<double>& weights);

}  // namespace sinerig::identify
