#include "identify/starts.h"

#include <cmath>
#include <random>

namespace sinerig::identify {

namespace {

using Eigen::ArrayXd;

// |(jx)² + 2ζp·jx + p²|.
ArrayXd pair_magnitude(const ArrayXd& x, double p, double damping) {
  const ArrayXd re = p * p - x.square();
  const ArrayXd im = 2.0 * damping * p * x;
  return (re.square() + im.square()).sqrt();
}

ArrayXd real_magnitude(const ArrayXd& x, double p) {
  return (x.square() + p * p).sqrt();
}

// Products over tens of factors stay in range when each is divided by its own size.
ArrayXd normalised(const ArrayXd& magnitude) {
  return magnitude / magnitude.mean();
}

template <typename Place>
ArrayXd pairs_at(const ArrayXd& x, int degree, double damping, const Place& place) {
  ArrayXd magnitude = ArrayXd::Ones(x.size());
  const int pairs = degree / 2;
  for (int i = 0; i < pairs; ++i)
    magnitude = normalised(magnitude * pair_magnitude(x, place((i + 0.5) / pairs), damping));
  if (degree % 2 == 1) magnitude = normalised(magnitude * real_magnitude(x, place(0.5)));
  return magnitude;
}

}  // namespace

std::vector<ArrayXd> starting_magnitudes(const ArrayXd& x, int degree, int random_sets,
                                         std::uint64_t seed) {
  const double first = x[0];
  const double last = x[x.size() - 1];
  const auto in_log = [&](double part) {
    return first * std::pow(last / first, part);
  };
  const auto in_x = [&](double part) {
    return first + (last - first) * part;
  };
  const auto all_real = [&] {
    ArrayXd magnitude = ArrayXd::Ones(x.size());
    for (int i = 0; i < degree; ++i)
      magnitude = normalised(magnitude * real_magnitude(x, in_log((i + 0.5) / degree)));
    return magnitude;
  };
  std::vector<ArrayXd> starts{pairs_at(x, degree, 0.3, in_log),  all_real(),
                              pairs_at(x, degree, 0.05, in_log), ArrayXd::Ones(x.size()),
                              pairs_at(x, degree, 0.01, in_log), pairs_at(x, degree, 0.05, in_x)};
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (int set = 0; set < random_sets; ++set) {
    const double damping = std::pow(10.0, -2.5 * uniform(random));
    const auto anywhere = [&](double) {
      return in_log(uniform(random));
    };
    starts.push_back(pairs_at(x, degree, damping, anywhere));
  }
  return starts;
}

}  // namespace sinerig::identify
