// The weights of Hassul's least squares as the command line names them.
#pragma once

#include <string>
#include <vector>

#include "identify/response.h"

namespace sinerig::cli {

struct WeightOptions {
  // none, 1/w (or 1/omega), column (of the CSV file), W1,W2,… or a file of one number per line
  std::string weights = "none";
  std::vector<double> num;  // or W_a(s), descending powers of s
  std::vector<double> den;

  bool given() const { return weights != "none" || !num.empty() || !den.empty(); }
};

// One weight per point. column: what the file of the response holds. Throws std::invalid_argument
// and record::SweepFileError for what is no weight or not as many as there are points.
std::vector<double> weights_of(const WeightOptions& options, const std::vector<double>& column,
                               const identify::Response& response);

}  // namespace sinerig::cli
