#include "identify/scatter.h"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

namespace sinerig::identify {

namespace {

constexpr std::size_t neighbours = 3;
constexpr double same_frequency = 1e-9;

struct Weighted {
  Eigen::Vector2d value;
  Eigen::Matrix2d information;
};

Weighted weighted(const ResponsePoint& point) {
  Eigen::Matrix2d covariance;
  covariance << point.variance_re, point.covariance, point.covariance, point.variance_im;
  return {{point.response.real(), point.response.imag()}, covariance.inverse()};
}

ResponsePoint averaged(const ResponsePoint& a, const ResponsePoint& b) {
  const Weighted first = weighted(a);
  const Weighted second = weighted(b);
  const Eigen::Matrix2d covariance = (first.information + second.information).inverse();
  const Eigen::Vector2d mean =
      covariance * (first.information * first.value + second.information * second.value);
  return {a.omega_rad_s, {mean[0], mean[1]}, covariance(0, 0), covariance(0, 1), covariance(1, 1)};
}

// The variance of a point whose neighbourhood has none is that of the nearest that has.
void fill_in(Response& pooled) {
  const Response known = pooled;
  const auto has = [&](std::size_t i) {
    return known[i].variance_re > 0.0;
  };
  for (std::size_t i = 0; i < known.size(); ++i) {
    for (std::size_t away = 1; away < known.size() && !(pooled[i].variance_re > 0.0); ++away) {
      const bool below = i >= away && has(i - away);
      if (!below && (i + away >= known.size() || !has(i + away))) continue;
      const double variance = known[below ? i - away : i + away].variance_re;
      pooled[i].variance_re = pooled[i].variance_im = variance;
    }
  }
}

}  // namespace

Response pooled_scatter(const Response& response, const std::vector<double>& degrees_of_freedom) {
  Response pooled = response;
  for (std::size_t i = 0; i < response.size(); ++i) {
    double sum = 0.0;
    double weights = 0.0;
    const std::size_t first = i >= neighbours ? i - neighbours : 0;
    for (std::size_t j = first; j < std::min(i + neighbours + 1, response.size()); ++j) {
      const double variance = 0.5 * (response[j].variance_re + response[j].variance_im);
      if (!(variance > 0.0) || !std::isfinite(variance)) continue;
      sum += degrees_of_freedom[j] * variance;
      weights += degrees_of_freedom[j];
    }
    pooled[i].variance_re = pooled[i].variance_im = weights > 0.0 ? sum / weights : 0.0;
    pooled[i].covariance = 0.0;
  }
  fill_in(pooled);
  return pooled;
}

Response merged(const std::vector<Response>& responses) {
  Response all;
  for (const Response& response : responses)
    all.insert(all.end(), response.begin(), response.end());
  std::stable_sort(all.begin(), all.end(), [](const ResponsePoint& a, const ResponsePoint& b) {
    return a.omega_rad_s < b.omega_rad_s;
  });
  const bool scatter = has_scatter(all);
  Response result;
  double count = 1.0;
  for (const ResponsePoint& point : all) {
    const bool same = !result.empty() && point.omega_rad_s - result.back().omega_rad_s <=
                                             same_frequency * point.omega_rad_s;
    if (!same) {
      result.push_back(point);
      count = 1.0;
    } else if (scatter) {
      result.back() = averaged(result.back(), point);
    } else {
      count += 1.0;
      result.back().response += (point.response - result.back().response) / count;
    }
  }
  return result;
}

}  // namespace sinerig::identify
