// Options and response turned into the problem that the search solves.
#pragma once

#include "identify/fit.h"
#include "identify/fit_data.h"
#include "identify/local_model.h"

namespace sinerig::identify {

struct FitSetup {
  FitData data;  // data.known holds the fixed factors, the path and, to first order, the hold
  ZerosPolesGain fixed;           // factors of the plant that are not fitted, with a known delay
  ZerosPolesGain fixed_and_path;  // the same with the delay of the path
  Freedom freedom;
};

// Throws std::invalid_argument as fit_maximum_likelihood does.
FitSetup prepare_fit(const Response& response, const FitOptions& options);

}  // namespace sinerig::identify
