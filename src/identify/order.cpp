#include "identify/order.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "identify/constraints.h"
#include "identify/fit_setup.h"
#include "identify/hold_images.h"
#include "identify/maximum_likelihood.h"
#include "identify/robust.h"
#include "identify/search.h"

namespace sinerig::identify {

namespace {

using Eigen::Index;

struct Structure {
  int zeros, poles, origin;
};

// Orders that in a row bring nothing before the sweep gives up.
constexpr int patience = 3;
// Some ten structures compete at each order, so the best of them gains more by chance than BIC,
// made for two, allows for. Exact choices in 250 runs with 3 and 4 added per parameter: example 3
// 247, 249; gimbal b 249, 249; random gimbals 248, 250.
constexpr double competition = 4.0;
constexpr int orders_above_the_lowest = 2;
constexpr int subsets_per_order = 4;
// The images of the hold are those of the last trial at first, so few passes are left to do.
constexpr int image_passes = 2;
// Images that change the response by less than this part of its scatter, or of what the trial
// leaves, have settled.
constexpr double settled_images = 0.03;
// Steps with the hold in the model: what a structure of too many parameters gains after them is
// nothing to choose it by.
constexpr int held_iterations = 12;
constexpr std::size_t most_constrained_fits = 8;
// Relative residual that no measurement leaves: settling and quantisation alone leave 1e-4.
constexpr double computed_residual = 1e-5;
// Of the scatter assumed where none is known: the least that explains the points serves.
constexpr std::array<double, 5> assumed_ladder{1.0, 2.5, 5.0, 10.0, 25.0};
// Of what is left with the noise unknown, which took all poles that seemed to help: less explains
// no model of fewer, and looking for outliers in vain takes seconds.
constexpr double hopeless = 0.6;

class Selector {
 public:
  Selector(const Response& response, const OrderSettings& settings)
      : response_(response), settings_(settings) {
    const auto values = static_cast<int>(2 * response.size());
    const int affordable = (values - 2) / 4;
    most_poles_ = std::min(settings.most_poles, std::max(affordable, 1));
    given_ = static_cast<int>(settings.fit.given_poles.size());
  }

  void sweep_orders() {
    double best = std::numeric_limits<double>::infinity();
    int without_gain = 0;
    for (int poles = first_order(); poles <= last_order(); ++poles) {
      const auto zeros = settings_.zeros.value_or(std::max(poles - 1, 0));
      const int origin = settings_.origin.value_or(0);
      if (!possible({zeros, poles, origin})) continue;
      const Trial trial = attempt({zeros, poles, origin}, {});
      const double criterion = unknown_noise_criterion(trial.candidate);
      if (!trial.candidate.at_limit && criterion < best) {
        best = criterion;
        images_ = trial.images;
        lowest_ = poles;
        delay_s_ = trial.delay_s;
        without_gain = 0;
      } else {
        ++without_gain;
      }
      if (trial.settled) return;
      if (!response_has_scatter() && without_gain >= patience) return;
    }
  }

  // An outlier costs an order two poles and two zeros to follow, or keeps every order unexplained:
  // an order at most as high that explains the rest by leaving points out is better when that is
  // cheaper than the parameters saved.
  bool drop_outliers() {
    if (!settings_.fit.robust || !response_has_scatter()) return false;
    const auto plain = ranked();
    const bool explained = any_explained();
    const int last = explained ? lowest_ - 1 : last_order();
    for (int poles = first_order(); poles <= last; ++poles) {
      const Structure structure{settings_.zeros.value_or(std::max(poles - 1, 0)), poles,
                                settings_.origin.value_or(0)};
      if (!possible(structure)) continue;
      FitSetup setup = prepare_fit(response_, options(structure));
      if (images_.size() > 0) setup.data.known *= images_;
      if (explained) narrow_delay(setup);
      const auto robust = fit_robustly(setup.data, setup.freedom, subsets_per_order);
      if (!robust) continue;
      const double criterion =
          robust->refined.rational.cost + setup.freedom.parameters() * penalty() +
          static_cast<double>(robust->outliers.size()) * cost_of_outlier(setup.data);
      if (explained && criterion >= plain.front().criterion) continue;
      Response kept;
      for (const Index i : robust->kept) kept.push_back(response_[static_cast<std::size_t>(i)]);
      response_ = kept;
      if (images_.size() > 0) images_ = images_(robust->kept).eval();
      trials_.clear();
      return true;
    }
    return false;
  }

  // Of the order below the lowest one the sweep has tried all but as many zeros as poles.
  void sweep_structures() {
    const int lowest = settings_.poles.value_or(lowest_);
    const int first = std::max(lowest - 1, first_order());
    const int last = std::max(first, std::min(lowest + orders_above_the_lowest, last_order()));
    for (int poles = first; poles <= last; ++poles)
      for (int origin = settings_.origin.value_or(0);
           origin <= settings_.origin.value_or(settings_.most_origin); ++origin)
        for (int fall = 0; fall <= (poles < lowest ? 0 : settings_.most_relative_degree); ++fall) {
          const int zeros = settings_.zeros.value_or(poles - fall);
          const Structure structure{zeros, poles, origin};
          if (!possible(structure) || known(structure)) continue;
          attempt(structure, delay_s_);
          if (settings_.zeros) break;
        }
  }

  std::vector<OrderCandidate> ranked() const {
    std::vector<OrderCandidate> table;
    for (OrderCandidate candidate : trials_) {
      candidate.criterion = criterion(candidate, 0);
      table.push_back(candidate);
    }
    std::sort(table.begin(), table.end(), [](const OrderCandidate& a, const OrderCandidate& b) {
      return a.at_limit != b.at_limit ? b.at_limit : a.criterion < b.criterion;
    });
    return table;
  }

  // A point left out counts as much χ² as it takes to be one.
  double criterion(OrderCandidate candidate, std::size_t outliers) const {
    candidate.chi2 += static_cast<double>(outliers) *
                      cost_of_outlier(make_fit_data(response_, settings_.fit.model_error));
    return response_has_scatter() && any_explained()
               ? candidate.chi2 + candidate.parameters * penalty()
               : unknown_noise_criterion(candidate);
  }

  FitOptions options(const Structure& structure) const {
    FitOptions chosen = settings_.fit;
    chosen.zeros = structure.zeros;
    chosen.poles = structure.poles;
    chosen.origin = structure.origin;
    return chosen;
  }

 private:
  struct Trial {
    OrderCandidate candidate;
    double delay_s = 0.0;
    Eigen::ArrayXcd images;  // of the hold; empty without one
    bool settled = false;
  };

  double values() const { return static_cast<double>(2 * response_.size()); }
  double penalty() const { return std::log(values()) + competition; }
  bool response_has_scatter() const {
    return has_scatter(response_) || settings_.fit.model_error > 0.0;
  }
  int first_order() const { return settings_.poles.value_or(given_); }
  int last_order() const { return settings_.poles.value_or(most_poles_); }

  // The order that follows the outliers has the delay right to within a few rad at the top.
  void narrow_delay(FitSetup& setup) const {
    if (!setup.freedom.delay) return;
    const double window_s = 3.0 / setup.data.omega[setup.data.points() - 1];
    setup.freedom.least_delay_s = std::max(0.0, delay_s_ - window_s);
    setup.freedom.largest_delay_s = delay_s_ + window_s;
  }

  bool possible(const Structure& s) const {
    const bool proper = settings_.fit.hold_period_s == 0.0 || s.zeros <= s.poles;
    return s.zeros >= std::max(-s.origin, 0) && s.poles >= given_ + std::max(s.origin, 0) && proper;
  }

  bool known(const Structure& s) const {
    return std::any_of(trials_.begin(), trials_.end(), [&s](const OrderCandidate& c) {
      return c.zeros == s.zeros && c.poles == s.poles && c.origin == s.origin;
    });
  }

  bool any_explained() const {
    return std::any_of(trials_.begin(), trials_.end(),
                       [](const OrderCandidate& c) { return c.explained && !c.at_limit; });
  }

  double unknown_noise_criterion(const OrderCandidate& c) const {
    // Relative residuals below 1e-9 are rounding: nothing to choose between them.
    const double per_value = std::max(c.chi2 / values(), 1e-18);
    return values() * std::log(per_value) + c.parameters * penalty();
  }

  // Left out, the images of the hold are an error that repeats: up to 3.4 % where the plant falls
  // as 1/ω, which is far above the scatter and is explained by a pole that is not there. Towards
  // half the rate they are as large as the response, the passes need not settle, and the model
  // itself takes the hold in.
  void include_images(FitData& data, const FitSetup& setup, const Freedom& freedom,
                      Refined& refined) const {
    const HoldModel hold(settings_.fit.hold_period_s, setup.fixed_and_path);
    bool settled = false;
    for (int pass = 0;; ++pass) {
      const auto images = hold_images(setup.data, freedom, refined.rational, hold);
      if (!images) break;
      const Eigen::ArrayXcd known = setup.data.known * *images;
      const Eigen::ArrayXd change = (known / data.known - 1.0).abs();
      data.known = known;
      refined.rational.cost = whitened(data, model_on_grid(data, refined.rational)).squaredNorm();
      const double residual = std::sqrt(refined.rational.cost / values());
      const double error = setup.data.scatter_known ? std::max(residual, 1.0) : residual;
      settled = (change <= settled_images * error * setup.data.sigma).all();
      if (pass == image_passes || settled) break;
      refined = refine(data, freedom, refined.rational);
    }
    if (!settled && std::isfinite(refined.rational.cost)) {
      Freedom held = freedom;
      held.hold = &hold;
      refined = refine(setup.data, held, refined.rational, held_iterations);
      if (const auto images = hold_images(setup.data, freedom, refined.rational, hold))
        data.known = setup.data.known * *images;
    }
    // What the exact model leaves, where the passes ended.
    refined.rational.cost = whitened(data, model_on_grid(data, refined.rational)).squaredNorm();
  }

  Trial attempt(const Structure& structure, std::optional<double> near_delay_s) {
    const FitSetup setup = prepare_fit(response_, options(structure));
    const bool held = settings_.fit.hold_period_s > 0.0;
    FitData data = setup.data;
    if (images_.size() > 0) data.known *= images_;
    Freedom free_roots = setup.freedom;
    free_roots.stable_poles = free_roots.stable_zeros = false;
    SearchSettings search_settings;
    search_settings.effort = Effort::quick;
    search_settings.random_starts = 2;
    search_settings.near_delay_s = near_delay_s;
    Refined refined = search(data, free_roots, search_settings);
    if (held && std::isfinite(refined.rational.cost))
      include_images(data, setup, free_roots, refined);
    if (std::isfinite(refined.rational.cost)) enforce_constraints(data, setup.freedom, refined);
    Trial trial;
    trial.delay_s = refined.rational.delay_s;
    if (held) trial.images = data.known / setup.data.known;
    const double cost = refined.rational.cost;
    const bool at_limit =
        std::isfinite(cost) && held_by_constraints(data, setup.freedom, refined, structure.origin);
    trial.settled = !at_limit && explained_by_noise(setup.data, setup.freedom, cost, 2.0);
    trial.candidate = {structure.zeros,
                       structure.poles,
                       structure.origin,
                       setup.freedom.parameters(),
                       cost,
                       0.0,
                       explained_by_noise(setup.data, setup.freedom, cost, 3.0),
                       at_limit};
    if (std::isfinite(cost)) trials_.push_back(trial.candidate);
    return trial;
  }

  Response response_;
  const OrderSettings& settings_;
  int most_poles_ = 1;
  int given_ = 0;
  int lowest_ = 1;
  double delay_s_ = 0.0;
  Eigen::ArrayXcd images_;  // of the hold, by the best trial so far; empty before it
  std::vector<OrderCandidate> trials_;
};

bool leans_on_constraints(const Response& response, const OrderSelection& selection) {
  const double first = response.front().omega_rad_s;
  const auto lean = [first](const std::vector<std::complex<double>>& roots) {
    return std::any_of(roots.begin(), roots.end(), [first](std::complex<double> root) {
      return root != 0.0 && near_axis(root, first);
    });
  };
  if (selection.chosen.stable && selection.chosen.origin > 0 &&
      hides_origin(selection.fit.zpk.zeros, first))
    return true;
  return (selection.chosen.stable && lean(selection.fit.zpk.poles)) ||
         (selection.chosen.minimum_phase && lean(selection.fit.zpk.zeros));
}

// Where a constrained search ends depends on its start more than a free one does, and a trial is
// quick: the best of them are fitted in full and compared by that.
void choose_constrained(const Response& response, const Selector& selector,
                        OrderSelection& selection) {
  auto& table = selection.table;
  std::vector<std::pair<OrderCandidate, OrderSelection>> fits;
  const std::size_t tried = std::min(table.size(), most_constrained_fits);
  for (std::size_t i = 0; i < tried; ++i) {
    OrderSelection full;
    full.chosen = selector.options({table[i].zeros, table[i].poles, table[i].origin});
    full.fit = fit_maximum_likelihood(response, full.chosen);
    table[i].chi2 = full.fit.chi2;
    table[i].at_limit = !full.fit.converged || leans_on_constraints(response, full);
    table[i].criterion = selector.criterion(table[i], full.fit.outliers.size());
    fits.emplace_back(table[i], full);
  }
  const auto before = [](const OrderCandidate& a, const OrderCandidate& b) {
    return a.at_limit != b.at_limit ? b.at_limit : a.criterion < b.criterion;
  };
  std::sort(table.begin(), table.begin() + static_cast<std::ptrdiff_t>(tried), before);
  const auto best = std::min_element(
      fits.begin(), fits.end(),
      [&before](const auto& a, const auto& b) { return before(a.first, b.first); });
  selection.chosen = best->second.chosen;
  selection.fit = best->second.fit;
}

OrderSelection select(const Response& response, const OrderSettings& settings) {
  Selector selector(response, settings);
  selector.sweep_orders();
  if (selector.drop_outliers()) selector.sweep_orders();
  selector.sweep_structures();
  OrderSelection selection;
  selection.table = selector.ranked();
  if (selection.table.empty())
    throw std::invalid_argument(
        "order: no structure is possible with the parts that are given; release one of them");
  if (settings.fit.stable || settings.fit.minimum_phase) {
    choose_constrained(response, selector, selection);
  } else {
    const OrderCandidate& best = selection.table.front();
    selection.chosen = selector.options({best.zeros, best.poles, best.origin});
    selection.fit = fit_maximum_likelihood(response, selection.chosen);
  }
  return selection;
}

}  // namespace

OrderSelection select_order(const Response& response, const OrderSettings& settings) {
  check_response(response, 3);
  OrderSelection unknown = select(response, settings);
  if (has_scatter(response) || settings.fit.model_error > 0.0 || settings.assumed_scatter == 0.0)
    return unknown;
  const double residual = std::sqrt(unknown.fit.chi2 / unknown.fit.degrees_of_freedom);
  if (residual <= computed_residual) return unknown;
  OrderSettings assumed = settings;
  for (const double factor : assumed_ladder) {
    assumed.fit.model_error = factor * settings.assumed_scatter;
    if (assumed.fit.model_error < hopeless * residual) continue;
    OrderSelection selection = select(response, assumed);
    if (!selection.table.front().explained ||
        selection.table.front().parameters > unknown.table.front().parameters)
      continue;
    selection.chosen.model_error = 0.0;
    // Against the median residual, points of uneven noise look like outliers.
    if (selection.fit.outliers.empty()) selection.chosen.robust = false;
    selection.fit = fit_maximum_likelihood(response, selection.chosen);
    return selection;
  }
  return unknown;
}

}  // namespace sinerig::identify
