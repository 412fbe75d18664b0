// Scatter estimated from few repetitions, and responses measured more than once.
#pragma once

#include <vector>

#include "identify/response.h"

namespace sinerig::identify {

// A variance of few degrees of freedom is off by half as often as not, and a fit weighted by it
// follows the points that happened to repeat well. Each point gets the mean of its own scatter and
// its neighbours', three on either side, weighted by their degrees of freedom, equal in re and im.
// degrees_of_freedom: one per point; 0 where the scatter is not known, such points take the
// neighbours'; where those have none either, the nearest that has one gives it. When no point has
// any, all come back without.
Response pooled_scatter(const Response& response, const std::vector<double>& degrees_of_freedom);

// Several measurements of one response as one: points at the same frequency (to 1e-9) are averaged,
// by inverse covariance where every point has scatter, plainly otherwise; ascending.
Response merged(const std::vector<Response>& responses);

}  // namespace sinerig::identify
