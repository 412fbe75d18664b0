#include "identify/choe.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace sinerig::identify {

namespace {

std::vector<Response> split(const Response& response, const HassulOrders& orders,
                            const std::vector<double>& edges_rad_s) {
  // Two real equations a point, 2(n+m+1) of them a band.
  const auto least_points = static_cast<std::size_t>(orders.n + orders.m + 1);
  std::vector<Response> parts(1);
  std::size_t band = 0;
  for (const ResponsePoint& point : response) {
    std::size_t reached = band;
    while (reached < edges_rad_s.size() && point.omega_rad_s > edges_rad_s[reached]) ++reached;
    if (reached > band && parts.back().size() >= least_points) parts.emplace_back();
    band = reached;
    parts.back().push_back(point);
  }
  if (parts.size() > 1 && parts.back().size() < least_points) {
    const Response last = parts.back();
    parts.pop_back();
    parts.back().insert(parts.back().end(), last.begin(), last.end());
  }
  return parts;
}

// The floor keeps a point where all models happen to cross from leaving the fit.
constexpr double weight_floor = 1e-4;
// Below this the spread of the models is rounding: exact data.
constexpr double no_spread = 1e-12;
// A point this close to an edge of equal sub-bands is on it, and opens the upper one.
constexpr double edge_tolerance = 1e-9;

}  // namespace

std::vector<double> equal_band_edges(const Response& response, int bands) {
  if (bands < 1)
    throw std::invalid_argument("choe: " + std::to_string(bands) +
                                " sub-bands; at least 1 is needed, 3 is usual");
  check_response(response, 1);
  const double log_first = std::log(response.front().omega_rad_s);
  const double log_width = (std::log(response.back().omega_rad_s) - log_first) / bands;
  std::vector<double> edges;
  for (int i = 1; i < bands; ++i)
    edges.push_back(std::exp(log_first + i * log_width) * (1.0 - edge_tolerance));
  return edges;
}

ChoeFit fit_choe(const Response& response, const HassulOrders& orders, int bands) {
  return fit_choe(response, orders, equal_band_edges(response, bands));
}

ChoeFit fit_choe(const Response& response, const HassulOrders& orders,
                 const std::vector<double>& edges_rad_s) {
  check_response(response, 1);
  for (std::size_t i = 0; i < edges_rad_s.size(); ++i)
    if (!(edges_rad_s[i] > (i == 0 ? 0.0 : edges_rad_s[i - 1])))
      throw std::invalid_argument("choe: the edges of the sub-bands must rise; sort them");
  ChoeFit fit;
  fit.bands = split(response, orders, edges_rad_s);
  for (const Response& band : fit.bands)
    fit.band_models.push_back(fit_hassul(band, orders, unit_weights(band)));

  const auto models = static_cast<double>(fit.band_models.size());
  fit.nominal.assign(response.size(), 0.0);
  fit.additive.assign(fit.band_models.size(), std::vector<double>(response.size()));
  fit.weight.assign(response.size(), 0.0);
  double largest_response = 0.0;
  for (std::size_t i = 0; i < response.size(); ++i) {
    const double omega = response[i].omega_rad_s;
    for (const TransferFunction& model : fit.band_models)
      fit.nominal[i] += model.at(omega) / models;
    for (std::size_t k = 0; k < fit.band_models.size(); ++k) {
      fit.additive[k][i] = std::abs(fit.band_models[k].at(omega) - fit.nominal[i]);
      fit.weight[i] = std::max(fit.weight[i], fit.additive[k][i]);
    }
    largest_response = std::max(largest_response, std::abs(response[i].response));
  }
  const double largest = *std::max_element(fit.weight.begin(), fit.weight.end());
  const bool spread = std::isfinite(largest) && largest > no_spread * largest_response;
  for (double& weight : fit.weight)
    weight = spread ? std::max(weight, weight_floor * largest) : 1.0;
  fit.model = fit_hassul(response, orders, fit.weight);
  return fit;
}

}  // namespace sinerig::identify
