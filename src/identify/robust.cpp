#include "identify/robust.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "identify/starts.h"

namespace sinerig::identify {

namespace {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::VectorXd;

constexpr double false_alarm = 1e-4;  // per response
constexpr double trimmed_part = 0.85;
constexpr int bounded_rounds = 5;
constexpr int redescending_rounds = 5;
constexpr double huber_limit = 1.5;
constexpr double tukey_limit = 6.0;
constexpr double least_trust = 1e-8;
constexpr double most_rejected = 0.15;
constexpr int most_reselections = 10;
constexpr std::size_t most_candidates = 6;
constexpr double subset_part = 0.7;

double lower_sum(ArrayXd squared, double part) {
  const auto count = static_cast<Index>(part * static_cast<double>(squared.size()));
  std::nth_element(squared.begin(), squared.begin() + count, squared.end());
  return squared.head(count).sum();
}

double median(ArrayXd values) {
  const auto middle = values.begin() + values.size() / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// The median of χ² with two degrees of freedom is 2 ln 2.
double noise_variance(const FitData& data, const ArrayXd& squared) {
  if (data.scatter_known) return 1.0;
  return std::max(median(squared) / (2.0 * std::log(2.0)), 1e-24);
}

double rejection_limit(const FitData& data, const ArrayXd& squared) {
  return cost_of_outlier(data) * noise_variance(data, squared);
}

ArrayXd residual_of(const FitData& data, const GridRational& rational) {
  Eigen::ArrayXcd model = data.known * rational.N / rational.D;
  if (rational.delay_s != 0.0)
    for (Index i = 0; i < model.size(); ++i)
      model[i] *= std::polar(1.0, -data.omega[i] * rational.delay_s);
  return squared_residuals(data, whitened(data, model));
}

ArrayXd bounded_trust(const ArrayXd& size) {
  return (huber_limit / size.max(huber_limit));
}

ArrayXd redescending_trust(const ArrayXd& size) {
  const ArrayXd inside = (1.0 - (size / tukey_limit).square()).max(0.0);
  return inside.square().max(least_trust);
}

struct Candidate {
  GridRational rational;
  ArrayXd squared;
  double trimmed_cost = 0.0;
};

// D_prev and trust are carried along a profile of delays.
Candidate reweighted_sequence(const FitData& data, double delay_s, Degrees degrees, ArrayXd& D_prev,
                              ArrayXd& trust, int rounds_bounded, int rounds_redescending) {
  Candidate candidate;
  for (int round = 0; round < rounds_bounded + rounds_redescending; ++round) {
    candidate.rational = linear_iterate(data.trusted(trust), delay_s, D_prev, degrees);
    D_prev = safe_magnitude(candidate.rational.D);
    candidate.squared = residual_of(data, candidate.rational);
    const double variance = std::max(noise_variance(data, candidate.squared),
                                     median(candidate.squared) / (2.0 * std::log(2.0)));
    const ArrayXd size = (candidate.squared / variance).sqrt();
    if (!size.allFinite()) break;
    trust = round < rounds_bounded ? bounded_trust(size) : redescending_trust(size);
  }
  candidate.trimmed_cost = candidate.squared.allFinite()
                               ? lower_sum(candidate.squared, trimmed_part)
                               : std::numeric_limits<double>::infinity();
  return candidate;
}

std::vector<Candidate> candidates(const FitData& data, const Freedom& freedom) {
  std::vector<Candidate> found;
  const double top = data.omega[data.points() - 1];
  const double span = freedom.delay ? freedom.largest_delay_s - freedom.least_delay_s : 0.0;
  const int steps = std::clamp(static_cast<int>(std::ceil(span * top / 0.6)), 0, 200);
  const auto starts = starting_magnitudes(data.x, freedom.degrees.denominator, 0, 1);
  for (std::size_t s = 0; s < (freedom.delay ? 2U : starts.size()); ++s) {
    ArrayXd D_prev = starts[s];
    ArrayXd trust = ArrayXd::Ones(data.points());
    for (int i = 0; i <= steps; ++i) {
      const double delay_s = freedom.least_delay_s + (steps > 0 ? span * i / steps : 0.0);
      const bool first = i == 0;
      found.push_back(reweighted_sequence(data, delay_s, freedom.degrees, D_prev, trust,
                                          first ? bounded_rounds : 3,
                                          first && steps == 0 ? redescending_rounds : 2));
    }
  }
  std::sort(found.begin(), found.end(),
            [](const Candidate& a, const Candidate& b) { return a.trimmed_cost < b.trimmed_cost; });
  return found;
}

std::vector<Index> inside(const ArrayXd& squared, double limit) {
  std::vector<Index> kept;
  for (Index i = 0; i < squared.size(); ++i)
    if (squared[i] <= limit) kept.push_back(i);
  return kept;
}

bool isolated(const std::vector<Index>& outliers) {
  for (std::size_t i = 2; i < outliers.size(); ++i)
    if (outliers[i] == outliers[i - 2] + 2) return false;
  return true;
}

std::size_t least_kept(const FitData& data) {
  return static_cast<std::size_t>((1.0 - most_rejected) * static_cast<double>(data.points()));
}

std::optional<RobustFit> settle(const FitData& data, const Freedom& freedom,
                                const Candidate& start) {
  RobustFit fit;
  GridRational rational = start.rational;
  ArrayXd squared = start.squared;
  // A linear iterate is not at the minimum: its own median sets a wider limit at first.
  double widening = std::max(1.0, median(squared) / (2.0 * std::log(2.0)));
  for (int round = 0; round < most_reselections; ++round) {
    if (!squared.allFinite()) return {};
    auto kept = inside(squared, rejection_limit(data, squared) * widening);
    const bool settled = round > 0 && widening == 1.0 && kept == fit.kept;
    if (settled || kept.size() < least_kept(data)) break;
    fit.kept = kept;
    const FitData part = data.subset(kept);
    fit.refined = refine(part, freedom, at_points(rational, kept));
    rational = at_all_points(part, freedom, fit.refined.rational, data);
    squared = residual_of(data, rational);
    widening = 1.0;
  }
  if (fit.kept.size() < least_kept(data)) return {};
  fit.outliers = points_left_out(data, fit.kept);
  if (fit.outliers.empty() || !isolated(fit.outliers)) return {};
  const FitData part = data.subset(fit.kept);
  if (data.scatter_known && !explained_by_noise(part, freedom, fit.refined.rational.cost, 3.0))
    return {};
  return fit;
}

// A fit of part of the points has a fair chance to hold no outlier at all.
std::optional<Candidate> from_random_subset(const FitData& data, const Freedom& freedom,
                                            std::mt19937_64& random) {
  std::vector<Index> order(static_cast<std::size_t>(data.points()));
  std::iota(order.begin(), order.end(), Index{0});
  std::shuffle(order.begin(), order.end(), random);
  order.resize(static_cast<std::size_t>(subset_part * static_cast<double>(data.points())));
  std::sort(order.begin(), order.end());
  if (2 * static_cast<int>(order.size()) < freedom.parameters() + 2) return {};
  const FitData part = data.subset(order);
  SearchSettings settings;
  settings.effort = Effort::quick;
  settings.random_starts = 0;
  const Refined refined = search(part, freedom, settings);
  if (!std::isfinite(refined.rational.cost)) return {};
  Candidate candidate;
  candidate.rational = at_all_points(part, freedom, refined.rational, data);
  candidate.squared = residual_of(data, candidate.rational);
  if (!candidate.squared.allFinite()) return {};
  return candidate;
}

double per_degree_of_freedom(double cost, std::size_t points, const Freedom& freedom) {
  return cost / std::max(static_cast<double>(2 * points) - freedom.parameters(), 1.0);
}

double per_degree_of_freedom(const RobustFit& fit, const Freedom& freedom) {
  return per_degree_of_freedom(fit.refined.rational.cost, fit.kept.size(), freedom);
}

double penalised(const RobustFit& fit, const FitData& data, double variance) {
  return fit.refined.rational.cost / variance +
         cost_of_outlier(data) * static_cast<double>(fit.outliers.size());
}

// A point left out costs what the threshold is worth, so of two explanations the one with fewer
// outliers wins.
std::optional<RobustFit> least_penalised(const std::vector<RobustFit>& fits, const FitData& data,
                                         const Freedom& freedom) {
  double variance = data.scatter_known ? 1.0 : std::numeric_limits<double>::infinity();
  if (!data.scatter_known)
    for (const RobustFit& fit : fits)
      variance = std::min(variance, per_degree_of_freedom(fit, freedom));
  variance = std::max(variance, 1e-24);
  const auto best =
      std::min_element(fits.begin(), fits.end(), [&](const RobustFit& a, const RobustFit& b) {
        return penalised(a, data, variance) < penalised(b, data, variance);
      });
  if (best == fits.end()) return {};
  return *best;
}

}  // namespace

ArrayXd squared_residuals(const FitData& data, const VectorXd& residual) {
  const Index g = data.points();
  return residual.head(g).array().square() + residual.tail(g).array().square();
}

double cost_of_outlier(const FitData& data) {
  return 2.0 * std::log(static_cast<double>(data.points()) / false_alarm);
}

GridRational at_points(const GridRational& rational, const std::vector<Index>& points) {
  return {rational.N(points), rational.D(points), rational.cost, rational.delay_s};
}

GridRational at_all_points(const FitData& part, const Freedom& freedom,
                           const GridRational& rational, const FitData& all) {
  const LocalModel model(part, freedom, rational);
  GridRational full;
  full.delay_s = rational.delay_s;
  full.N.resize(all.points());
  full.D.resize(all.points());
  for (Index i = 0; i < all.points(); ++i) {
    const std::complex<double> s{0.0, all.x[i]};
    full.N[i] = model.N_basis().at(model.parameters().n, s).value;
    full.D[i] = model.D_basis().at(model.parameters().d, s).value;
  }
  return full;
}

bool outliers_suspected(const FitData& data, const VectorXd& residual) {
  const ArrayXd squared = squared_residuals(data, residual);
  return squared.maxCoeff() > rejection_limit(data, squared);
}

std::vector<Index> points_left_out(const FitData& data, const std::vector<Index>& kept) {
  std::vector<Index> left_out;
  for (Index i = 0; i < data.points(); ++i)
    if (!std::binary_search(kept.begin(), kept.end(), i)) left_out.push_back(i);
  return left_out;
}

std::optional<std::vector<Index>> acceptable_points(const FitData& data, const VectorXd& residual) {
  const ArrayXd squared = squared_residuals(data, residual);
  const std::vector<Index> kept = inside(squared, rejection_limit(data, squared));
  if (kept.size() < least_kept(data) || !isolated(points_left_out(data, kept))) return {};
  return kept;
}

bool explains_better(const RobustFit& robust, const Refined& of_all, const FitData& data,
                     const Freedom& freedom) {
  const double cost = of_all.rational.cost;
  double variance = 1.0;
  if (!data.scatter_known)
    variance =
        std::min(per_degree_of_freedom(robust, freedom),
                 per_degree_of_freedom(cost, robust.kept.size() + robust.outliers.size(), freedom));
  variance = std::max(variance, 1e-24);
  return penalised(robust, data, variance) < cost / variance;
}

std::optional<RobustFit> fit_robustly(const FitData& data, const Freedom& freedom,
                                      int random_subsets) {
  if (2 * data.points() < 2 * freedom.parameters() + 4) return {};
  std::vector<RobustFit> fits;
  const auto found = candidates(data, freedom);
  for (std::size_t i = 0; i < std::min(found.size(), most_candidates); ++i)
    if (auto fit = settle(data, freedom, found[i])) fits.push_back(std::move(*fit));
  std::mt19937_64 random(1);
  for (int subset = 0; subset < random_subsets; ++subset)
    if (const auto candidate = from_random_subset(data, freedom, random))
      if (auto fit = settle(data, freedom, *candidate)) fits.push_back(std::move(*fit));
  return least_penalised(fits, data, freedom);
}

}  // namespace sinerig::identify
