#include "identify/transient_modes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "identify/motion_problem.h"

namespace sinerig::identify {

namespace {

constexpr int least_ticks = 100;
constexpr int relocations = 10;
// The criterion has to rise this often in a row before more poles are not tried.
constexpr int patience = 3;

void check(const MotionRecord& record) {
  if (record.input.size() != record.output.size()) {
    throw std::invalid_argument("a record of a motion: " + std::to_string(record.input.size()) +
                                " inputs and " + std::to_string(record.output.size()) +
                                " outputs; there must be one of each per tick");
  }
  if (record.input.size() < least_ticks) {
    throw std::invalid_argument("a record of a motion: " + std::to_string(record.input.size()) +
                                " ticks; modes need " + std::to_string(least_ticks) +
                                " at least, record for longer");
  }
  const auto [low, high] = std::minmax_element(record.input.begin(), record.input.end());
  if (*low == *high) {
    throw std::invalid_argument(
        "a record of a motion: the input never changes, so nothing was excited");
  }
}

}  // namespace

FoundModes find_modes(const MotionRecord& record, const ModeSettings& settings) {
  check(record);
  const MotionProblem problem{record, settings};
  const double samples = problem.samples();
  MotionFit best;
  double best_criterion = std::numeric_limits<double>::infinity();
  int worse = 0;
  for (int order = 1; order <= settings.most_poles && worse < patience; ++order) {
    std::vector<std::complex<double>> poles = problem.spread(order);
    for (int i = 0; i < relocations; ++i) poles = problem.relocated(poles);
    const MotionFit fit = problem.refined(poles);
    const double parameters = 3.0 * static_cast<double>(order_of(fit.poles));
    const double criterion = samples * std::log(fit.rss / samples) + parameters * std::log(samples);
    if (criterion < best_criterion) {
      best_criterion = criterion;
      best = fit;
      worse = 0;
    } else {
      ++worse;
    }
  }
  FoundModes found;
  found.poles = best.poles;
  found.degrees_of_freedom =
      samples - 3.0 * static_cast<double>(order_of(best.poles)) - settings.most_delay_ticks - 2.0;
  found.noise_variance = best.rss / found.degrees_of_freedom;
  found.covariance = best.covariance * found.noise_variance;
  return found;
}

}  // namespace sinerig::identify
