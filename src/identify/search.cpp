#include "identify/search.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "identify/starts.h"

namespace sinerig::identify {

namespace {

using Eigen::ArrayXd;
using Eigen::Index;

constexpr int most_linear_iterations = 12;
// Phase at the top frequency between two delays of the profile. Refinement with the delay free
// comes home from about 1 rad away.
constexpr double profile_step_rad = 0.5;
constexpr double near_window_rad = 1.5;
constexpr int most_profile_points = 200;
// Starts that must end in the same minimum before it counts as the global one without noise to
// judge by.
constexpr int most_agreement = 8;

// Iterates from one |D|; the first, the third and the last are worth refining, because with noise
// the fixpoint is not the best of them.
std::vector<GridRational> linear_sequence(const FitData& data, double delay_s, ArrayXd D_prev,
                                          Degrees degrees, int most_iterations) {
  std::vector<GridRational> kept;
  GridRational iterate;
  double previous_cost = std::numeric_limits<double>::infinity();
  for (int i = 0; i < most_iterations; ++i) {
    iterate = linear_iterate(data, delay_s, D_prev, degrees);
    D_prev = safe_magnitude(iterate.D);
    if (!D_prev.allFinite()) break;
    const bool settled = std::abs(iterate.cost - previous_cost) <= 1e-3 * iterate.cost;
    previous_cost = iterate.cost;
    if (i == 0 || i == 2) kept.push_back(iterate);
    if (settled) break;
  }
  if (std::isfinite(iterate.cost)) kept.push_back(iterate);
  return kept;
}

void sort_by_cost(std::vector<GridRational>& rationals) {
  std::sort(rationals.begin(), rationals.end(),
            [](const GridRational& a, const GridRational& b) { return a.cost < b.cost; });
}

// Refines candidates, best first, until the stopping rule of search() holds.
class Contest {
 public:
  Contest(const FitData& data, const Freedom& freedom) : data_(data), freedom_(freedom) {
    best_.rational.cost = std::numeric_limits<double>::infinity();
  }

  void enter(const GridRational& candidate) {
    if (!std::isfinite(candidate.cost)) return;
    Refined refined = refine(data_, freedom_, candidate);
    refined.iterations += best_.iterations;
    const double cost = refined.rational.cost;
    const double tolerance = 1e-4 * std::abs(best_.rational.cost);
    agreeing_ = std::abs(cost - best_.rational.cost) <= tolerance
                    ? agreeing_ + 1
                    : (cost < best_.rational.cost ? 1 : agreeing_);
    if (cost < best_.rational.cost)
      best_ = refined;
    else
      best_.iterations = refined.iterations;
  }

  bool decided() const {
    const double cost = best_.rational.cost;
    return explained_by_noise(data_, freedom_, cost, 1.0) ||
           (agreeing_ >= 2 && explained_by_noise(data_, freedom_, cost, 3.0));
  }
  // Where noise does not explain the best, agreement of several starts is the only evidence.
  bool agreed(int starts) const { return agreeing_ >= starts; }
  const Refined& best() const { return best_; }

 private:
  const FitData& data_;
  const Freedom& freedom_;
  Refined best_;
  int agreeing_ = 0;
};

std::vector<double> profile_delays(const FitData& data, const Freedom& freedom,
                                   std::optional<double> near_delay_s) {
  const double top = data.omega[data.points() - 1];
  double first = freedom.least_delay_s;
  double last = freedom.largest_delay_s;
  if (near_delay_s) {
    first = std::clamp(*near_delay_s - near_window_rad / top, first, last);
    last = std::clamp(*near_delay_s + near_window_rad / top, first, last);
  }
  const double span = last - first;
  const int steps = std::clamp(static_cast<int>(std::ceil(span * top / profile_step_rad)), 1,
                               most_profile_points);
  std::vector<double> delays;
  for (int i = 0; i <= steps; ++i) delays.push_back(first + span * i / steps);
  return delays;
}

// Each delay starts from its neighbour's D.
std::vector<GridRational> followed_profile(const FitData& data, const Freedom& freedom,
                                           std::vector<double> delays, ArrayXd D_prev,
                                           bool rising) {
  if (!rising) std::reverse(delays.begin(), delays.end());
  std::vector<GridRational> profile;
  for (const double delay_s : delays) {
    const int iterations = profile.empty() ? most_linear_iterations : 3;
    const auto sequence = linear_sequence(data, delay_s, D_prev, freedom.degrees, iterations);
    if (sequence.empty()) continue;
    profile.push_back(sequence.back());
    D_prev = safe_magnitude(sequence.back().D);
  }
  return profile;
}

// Enters candidates by rising cost until the contest is decided or `agreement` of them end alike.
void enter_best(std::vector<GridRational>& candidates, std::size_t most, int agreement,
                Contest& contest) {
  sort_by_cost(candidates);
  for (std::size_t i = 0; i < std::min(candidates.size(), most); ++i) {
    contest.enter(candidates[i]);
    if (contest.decided() || contest.agreed(agreement)) return;
  }
}

// A wrong minimum keeps a pole pair where the data need none. With one pair more there is room for
// all; each pair in turn is then taken out again.
void contest_pruned(const FitData& data, const Freedom& freedom, const SearchSettings& settings,
                    Contest& contest) {
  Freedom wider = freedom;
  wider.degrees.numerator += 2;
  wider.degrees.denominator += 2;
  if (wider.parameters() > 2 * data.points() || freedom.hold) return;
  SearchSettings quick = settings;
  quick.effort = Effort::quick;
  quick.warm.clear();
  const Refined wide = search(data, wider, quick);
  if (!std::isfinite(wide.rational.cost)) return;
  const LocalModel model(data, wider, wide.rational);
  const Eigen::ArrayXcd jx = data.x * std::complex<double>{0.0, 1.0};
  std::vector<GridRational> pruned;
  for (const auto pole : model.D_basis().roots(model.parameters().d)) {
    if (pole.imag() <= 0.0) continue;
    const Eigen::ArrayXcd left = wide.rational.D / ((jx - pole) * (jx - std::conj(pole)));
    const auto sequence =
        linear_sequence(data, wide.rational.delay_s, safe_magnitude(left), freedom.degrees, 4);
    pruned.insert(pruned.end(), sequence.begin(), sequence.end());
  }
  enter_best(pruned, 8, most_agreement, contest);
}

void contest_delays(const FitData& data, const Freedom& freedom, const std::vector<ArrayXd>& starts,
                    const SearchSettings& settings, Contest& contest) {
  const std::vector<double> delays = profile_delays(data, freedom, settings.near_delay_s);
  for (const bool rising : {true, false}) {
    auto profile = followed_profile(data, freedom, delays, starts[0], rising);
    enter_best(profile, settings.effort == Effort::quick ? 2 : 3, most_agreement, contest);
    if (contest.decided() || settings.effort == Effort::quick) return;
  }
  contest_pruned(data, freedom, settings, contest);
  if (contest.decided()) return;
  std::vector<GridRational> best_of_each_delay;
  for (const double delay_s : delays) {
    std::vector<GridRational> here;
    for (std::size_t i = 0; i < 4; ++i) {
      const auto sequence = linear_sequence(data, delay_s, starts[i], freedom.degrees, 8);
      here.insert(here.end(), sequence.begin(), sequence.end());
    }
    sort_by_cost(here);
    if (!here.empty()) best_of_each_delay.push_back(here.front());
  }
  enter_best(best_of_each_delay, 60, most_agreement, contest);
}

void contest_starts(const FitData& data, const Freedom& freedom, const std::vector<ArrayXd>& starts,
                    const SearchSettings& settings, Contest& contest) {
  std::vector<GridRational> reserve;
  for (const ArrayXd& start : starts) {
    auto sequence = linear_sequence(data, freedom.least_delay_s, start, freedom.degrees,
                                    most_linear_iterations);
    if (sequence.empty()) continue;
    sort_by_cost(sequence);
    contest.enter(sequence.front());
    if (contest.decided()) return;
    reserve.insert(reserve.end(), sequence.begin() + 1, sequence.end());
    if (contest.agreed(most_agreement)) break;
    if (settings.effort == Effort::quick && contest.agreed(2)) return;
  }
  enter_best(reserve, 6, most_agreement, contest);
  if (!contest.decided() && settings.effort == Effort::thorough)
    contest_pruned(data, freedom, settings, contest);
}

}  // namespace

bool explained_by_noise(const FitData& data, const Freedom& freedom, double cost, double width) {
  const auto values = static_cast<double>(2 * data.points());
  if (cost <= values * 1e-18 / data.sigma.square().maxCoeff()) return true;
  if (!data.scatter_known) return false;
  const double degrees_of_freedom = std::max(values - freedom.parameters(), 0.0);
  return cost <= degrees_of_freedom + width * std::sqrt(2.0 * degrees_of_freedom);
}

double largest_plausible_delay(const FitData& data, Degrees degrees) {
  const Eigen::ArrayXcd g = data.reduced(0.0);
  double fall = 0.0;
  for (Index i = 1; i < g.size(); ++i) fall -= std::arg(g[i] / g[i - 1]);
  const double lead = 0.5 * std::numbers::pi * (degrees.numerator + 1);
  const double band = data.omega[g.size() - 1] - data.omega[0];
  return std::max(fall + lead, 0.5 * std::numbers::pi) / band;
}

Refined search(const FitData& data, const Freedom& freedom, const SearchSettings& settings) {
  Contest contest(data, freedom);
  for (const GridRational& warm : settings.warm) contest.enter(warm);
  if (contest.decided()) return contest.best();
  const auto starts = starting_magnitudes(data.x, freedom.degrees.denominator,
                                          settings.random_starts, settings.seed);
  if (freedom.delay)
    contest_delays(data, freedom, starts, settings, contest);
  else
    contest_starts(data, freedom, starts, settings, contest);
  return contest.best();
}

}  // namespace sinerig::identify
