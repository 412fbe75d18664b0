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
  std::vector<Index> kept;  // indices of these points
};

std::vector<Index> all_points(const FitData& data) {
  std::vector<Index> all(static_cast<std::size_t>(data.points()));
  std::iota(all.begin(), all.end(), Index{0});
  return all;
}

void take(const RobustFit& robust, const FitData& data, Solution& solution) {
  const int earlier = solution.refined.iterations;
  solution.data = data.subset(robust.kept);
  solution.refined = robust.refined;
  solution.refined.iterations += earlier;
  solution.kept = robust.kept;
}

void search_thoroughly(const FitData& data, const Freedom& freedom, SearchSettings settings,
                       Solution& solution) {
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
}

Solution search_with_outliers(const FitData& data, const Freedom& freedom,
                              const FitOptions& options) {
  SearchSettings settings;
  settings.random_starts = options.random_starts;
  settings.seed = options.seed;
  settings.effort = Effort::quick;
  Solution solution{data, search(data, freedom, settings), all_points(data)};
  const auto suspected = [&] {
    return options.robust &&
           outliers_suspected(data, whitened(data, model_on_grid(data, solution.refined.rational)));
  };
  const bool explained = explained_by_noise(data, freedom, solution.refined.rational.cost, 3.0);
  if (explained && !suspected()) return solution;
  if (options.robust && (data.scatter_known || explained)) {
    if (const auto robust = fit_robustly(data, freedom)) {
      take(*robust, data, solution);
      return solution;
    }
  }
  if (explained) return solution;
  search_thoroughly(data, freedom, settings, solution);
  // Without scatter nothing says that a fit is good enough, and a search that ended short of the
  // minimum leaves large residuals that are no outliers.
  if (!data.scatter_known && suspected()) {
    const auto robust = fit_robustly(data, freedom);
    if (robust && explains_better(*robust, solution.refined, data, freedom))
      take(*robust, data, solution);
  }
  return solution;
}

void refine_again(Solution& solution, const Freedom& freedom) {
  const int earlier = solution.refined.iterations;
  solution.refined = refine(solution.data, freedom, solution.refined.rational);
  solution.refined.iterations += earlier;
}

// The images of the hold, first as a correction of the data, then exactly inside the model. plain:
// all points without images.
constexpr int image_passes = 4;

void include_hold(const FitData& plain, const Freedom& freedom, const Freedom& held,
                  Solution& solution) {
  const FitData kept = plain.subset(solution.kept);
  for (int pass = 0; pass < image_passes; ++pass) {
    const auto images = hold_images(kept, freedom, solution.refined.rational, *held.hold);
    if (!images) break;
    solution.data.known = kept.known * *images;
    refine_again(solution, freedom);
  }
  refine_again(solution, held);
}

// Of the model behind its hold, at all points and not only those that were kept.
Eigen::ArrayXcd held_at_all(const FitData& all, const Freedom& held, const Solution& solution) {
  const LocalModel model(solution.data, held, solution.refined.rational);
  const LocalModel::Parameters& at = model.parameters();
  return held.hold->response(model.N_basis(), at.n, model.D_basis(), at.d, at.delay_s, all);
}

// Points that were judged by a model of which the hold was not exact yet are judged again.
constexpr int most_judgements = 5;

void judge_again(const FitData& plain, const Freedom& freedom, const Freedom& held,
                 Solution& solution) {
  for (int round = 0; round < most_judgements; ++round) {
    const Eigen::ArrayXcd exact = held_at_all(plain, held, solution);
    if (!exact.allFinite()) return;
    const std::vector<Index> kept =
        acceptable_points(plain, whitened(plain, exact)).value_or(all_points(plain));
    if (kept == solution.kept) return;
    const GridRational everywhere =
        at_all_points(solution.data, held, solution.refined.rational, plain);
    solution.data = plain.subset(kept);
    solution.refined.rational = at_points(everywhere, kept);
    solution.kept = kept;
    include_hold(plain, freedom, held, solution);
  }
}

// The images come in before any point is judged: what they add at the top of the band is far above
// the scatter, and a model without them takes good points for outliers.
Solution search_behind_hold(const FitData& plain, const Freedom& freedom, const Freedom& held,
                            const FitOptions& options) {
  SearchSettings settings;
  settings.random_starts = options.random_starts;
  settings.seed = options.seed;
  settings.effort = Effort::quick;
  Solution solution{plain, search(plain, freedom, settings), all_points(plain)};
  if (!std::isfinite(solution.refined.rational.cost)) return solution;
  include_hold(plain, freedom, held, solution);
  const Eigen::ArrayXcd exact = held_at_all(plain, held, solution);
  const bool explained = explained_by_noise(plain, freedom, solution.refined.rational.cost, 3.0);
  if (explained && !(options.robust && outliers_suspected(plain, whitened(plain, exact))))
    return solution;
  const int earlier = solution.refined.iterations;
  FitData corrected = plain;
  const Eigen::ArrayXcd known =
      plain.known * exact / model_on_grid(plain, solution.refined.rational);
  if (known.allFinite()) corrected.known = known;
  solution = search_with_outliers(corrected, freedom, options);
  solution.refined.iterations += earlier;
  if (!std::isfinite(solution.refined.rational.cost)) return solution;
  include_hold(plain, freedom, held, solution);
  if (options.robust) judge_again(plain, freedom, held, solution);
  return solution;
}

// Two passes leave 1e-4 of the first one's change at 5 % noise.
constexpr int relative_passes = 2;

void weigh_by_model(Solution& solution, const Freedom& freedom) {
  if (!solution.data.scatter_relative) return;
  const FitData measured = solution.data;
  for (int pass = 0; pass < relative_passes; ++pass) {
    solution.data =
        measured.relative_to(LocalModel(measured, freedom, solution.refined.rational).response());
    if (!solution.data.w_rr.allFinite()) {
      solution.data = measured;
      return;
    }
    refine_again(solution, freedom);
  }
}

[[noreturn]] void refuse_infinite(const FitOptions& options) {
  throw std::invalid_argument(
      "fit: the model of " + std::to_string(options.zeros) + " zeros and " +
      std::to_string(options.poles) +
      " poles is not finite at every measured frequency; lower the orders or check the units");
}

}  // namespace

Fit fit_maximum_likelihood(const Response& response, const FitOptions& options) {
  FitSetup setup = prepare_fit(response, options);
  Freedom free_roots = setup.freedom;
  free_roots.stable_poles = free_roots.stable_zeros = false;
  Freedom held = free_roots;
  const HoldModel hold(options.hold_period_s, setup.fixed_and_path);
  if (options.hold_period_s > 0.0) held.hold = setup.freedom.hold = &hold;
  Solution solution = held.hold ? search_behind_hold(setup.data, free_roots, held, options)
                                : search_with_outliers(setup.data, free_roots, options);
  if (!std::isfinite(solution.refined.rational.cost))
    throw std::invalid_argument(
        "fit: no start gave a finite model of " + std::to_string(options.zeros) + " zeros and " +
        std::to_string(options.poles) + " poles; lower the orders or check the units");
  weigh_by_model(solution, held);
  enforce_constraints(solution.data, setup.freedom, solution.refined);
  Fit fit =
      make_fit(setup, solution.data, solution.refined, points_left_out(setup.data, solution.kept));
  fit.model_error = setup.data.scatter_known ? options.model_error : 0.0;
  const bool finite = std::ranges::all_of(response, [&](const ResponsePoint& point) {
    return std::isfinite(std::norm(fit.zpk.at(point.omega_rad_s)));
  });
  if (!finite || !std::isfinite(fit.chi2)) refuse_infinite(options);
  return fit;
}

}  // namespace sinerig::identify
