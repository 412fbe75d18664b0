#include "cli/fit_weights.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "cli/csv_response.h"
#include "identify/hassul.h"

namespace sinerig::cli {

namespace {

using identify::Response;

constexpr const char* wanted =
    "wanted none, 1/w, column, one number per point by commas, or a file of one number per line";

bool numbers_only(const std::string& text, std::vector<double>& numbers) {
  std::istringstream stream{text};
  std::string field;
  while (std::getline(stream, field, ',')) {
    char* end = nullptr;
    numbers.push_back(std::strtod(field.c_str(), &end));
    if (field.empty() || *end != '\0') return false;
  }
  return !numbers.empty();
}

std::vector<double> of_function(const WeightOptions& options, const Response& response) {
  if (options.weights != "none")
    throw std::invalid_argument("--weights and --weight-num are two weights; give one");
  if (options.num.empty() || options.den.empty())
    throw std::invalid_argument("--weight-num and --weight-den belong together: W_a(s) = num/den");
  std::vector<double> weights = identify::weights_from({options.num, options.den, 0.0}, response);
  const auto unusable = [](double weight) {
    return !std::isfinite(weight) || weight <= 0.0;
  };
  if (std::any_of(weights.begin(), weights.end(), unusable))
    throw std::invalid_argument(
        "--weight-num over --weight-den: |W_a| must be finite and above zero at every point");
  return weights;
}

}  // namespace

std::vector<double> weights_of(const WeightOptions& options, const std::vector<double>& column,
                               const Response& response) {
  if (!options.num.empty() || !options.den.empty()) return of_function(options, response);
  if (options.weights == "none") return identify::unit_weights(response);
  if (options.weights == "1/w" || options.weights == "1/omega")
    return identify::inverse_frequency_weights(response);
  std::vector<double> weights;
  if (options.weights == "column") {
    weights = column;
    if (weights.empty())
      throw std::invalid_argument(
          "--weights column: the file has no column \"weight\", or several files were given");
  } else if (std::ifstream{options.weights}) {
    weights = read_number_column(options.weights);
  } else if (!numbers_only(options.weights, weights)) {
    throw std::invalid_argument("--weights is \"" + options.weights + "\"; " + wanted);
  }
  if (weights.size() != response.size())
    throw std::invalid_argument("--weights: " + std::to_string(weights.size()) + " numbers for " +
                                std::to_string(response.size()) + " points; " + wanted);
  return weights;
}

}  // namespace sinerig::cli
