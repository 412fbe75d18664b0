#include "identify/maximum_likelihood.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <stdexcept>
#include <string>

#include "identify/constraints.h"
#include "identify/fit_result.h"
#include "identify/fit_setup.h"
#include "identify/hold_images.h"
#include "identify/robust.h"
#include "identify/search.h"

namespace sinerig::identify {

namespace {

using Eigen::Index;

struct Solution {
  FitData data;  // the points kept, weighted as in the last pass
  Refined refined;
  std::vector<Index> outliers;
};

Solution search_with_outliers(const FitData& data, const Freedom& freedom,
                              const FitOptions& options) {
  SearchSettings settings;
  settings.random_starts = options.random_starts;
  settings.seed = options.seed;
  settings.effort = Effort::quick;
  Solution solution{data, search(data, freedom, settings), {}};
  const auto residual = [&] {
    return whitened(data, model_on_grid(data, solution.refined.rational));
  };
  const bool explained = explained_by_noise(data, freedom, solution.refined.rational.cost, 3.0);
  if (explained && !(options.robust && outliers_suspected(data, residual()))) return solution;
  if (options.robust) {
    if (auto robust = fit_robustly(data, freedom)) {
      solution.data = data.subset(robust->kept);
      robust->refined.iterations += solution.refined.iterations;
      solution.refined = robust->refined;
      solution.outliers = robust->outliers;
      return solution;
    }
  }
  if (explained) return solution;
  settings.effort = Effort::thorough;
  settings.warm.push_back(solution.refined.rational);
  if (freedom.delay) {
    Freedom no_delay = freedom;
    no_delay.delay = false;
    SearchSettings quick = settings;
    quick.effort = Effort::quick;
    quick.warm.clear();
    settings.warm.push_back(search(data, no_delay, quick).rational);
  }
  const int earlier = solution.refined.iterations;
  solution.refined = search(data, freedom, settings);
  solution.refined.iterations += earlier;
  return solution;
}

void refine_again(Solution& solution, const Freedom& freedom) {
  const int earlier = solution.refined.iterations;
  solution.refined = refine(solution.data, freedom, solution.refined.rational);
  solution.refined.iterations += earlier;
}

// Two passes leave 1e-4 of the first one's change at 5 % noise.
constexpr int relative_passes = 2;

void weigh_by_model(Solution& solution, const Freedom& freedom) {
  if (!solution.data.scatter_relative) return;
  const FitData measured = solution.data;
  for (int pass = 0; pass < relative_passes; ++pass) {
    solution.data = measured.relative_to(model_on_grid(measured, solution.refined.rational));
    if (!solution.data.w_rr.allFinite()) {
      solution.data = measured;
      return;
    }
    refine_again(solution, freedom);
  }
}

// The images of the hold, first as a correction of the data, then exactly inside the model.
constexpr int image_passes = 4;

void include_hold(Solution& solution, Freedom& freedom, const HoldModel& hold) {
  const Eigen::ArrayXcd without_images = solution.data.known;
  for (int pass = 0; pass < image_passes; ++pass) {
    FitData plain = solution.data;
    plain.known = without_images;
    const auto images = hold_images(plain, freedom, solution.refined.rational, hold);
    if (!images) break;
    solution.data.known = without_images * *images;
    refine_again(solution, freedom);
  }
  freedom.hold = &hold;
  refine_again(solution, freedom);
}

}  // namespace

Fit fit_maximum_likelihood(const Response& response, const FitOptions& options) {
  FitSetup setup = prepare_fit(response, options);
  Freedom free_roots = setup.freedom;
  free_roots.stable_poles = free_roots.stable_zeros = false;
  Solution solution = search_with_outliers(setup.data, free_roots, options);
  if (!std::isfinite(solution.refined.rational.cost))
    throw std::invalid_argument(
        "fit: no start gave a finite model of " + std::to_string(options.zeros) + " zeros and " +
        std::to_string(options.poles) + " poles; lower the orders or check the units");
  weigh_by_model(solution, free_roots);
  const HoldModel hold(options.hold_period_s, setup.fixed_and_path);
  if (options.hold_period_s > 0.0) include_hold(solution, setup.freedom, hold);
  enforce_constraints(solution.data, setup.freedom, solution.refined);
  Fit fit = make_fit(setup, solution.data, solution.refined, solution.outliers);
  fit.model_error = setup.data.scatter_known ? options.model_error : 0.0;
  const bool finite = std::ranges::all_of(response, [&](const ResponsePoint& point) {
    return std::isfinite(std::norm(fit.zpk.at(point.omega_rad_s)));
  });
  if (!finite || !std::isfinite(fit.chi2))
    throw std::invalid_argument(
        "fit: the model of " + std::to_string(options.zeros) + " zeros and " +
        std::to_string(options.poles) +
        " poles is not finite at every measured frequency; lower the orders or check the units");
  return fit;
}

}  // namespace sinerig::identify
