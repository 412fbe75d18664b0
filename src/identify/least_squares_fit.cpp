#include "identify/least_squares_fit.h"

#include <algorithm>
#include <stdexcept>

#include "identify/fit_result.h"
#include "identify/fit_setup.h"
#include "identify/polynomial.h"

namespace sinerig::identify {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;

std::vector<double> without_origin(std::vector<double> coefficients, int at_origin) {
  coefficients.resize(coefficients.size() - static_cast<std::size_t>(std::max(at_origin, 0)));
  return coefficients;
}

GridRational on_grid(const FitData& data, const TransferFunction& model, int origin) {
  const std::vector<double> num = without_origin(model.num, -origin);
  const std::vector<double> den = without_origin(model.den, origin);
  GridRational rational{Eigen::ArrayXcd(data.points()), Eigen::ArrayXcd(data.points())};
  for (Index i = 0; i < data.points(); ++i) {
    const Complex s{0.0, data.omega[i]};
    rational.N[i] = evaluate_polynomial(num, s);
    rational.D[i] = evaluate_polynomial(den, s);
  }
  return rational;
}

}  // namespace

Fit describe_least_squares(const Response& response, const FitOptions& options,
                           const HassulOrders& orders, const TransferFunction& model,
                           const std::vector<double>& weights) {
  FitOptions exact = options;
  exact.zeros = orders.m + std::max(-orders.k, 0);
  exact.poles = orders.n + std::max(orders.k, 0);
  exact.origin = orders.k;
  exact.static_gain.reset();
  exact.given_poles.clear();
  exact.stable = exact.minimum_phase = false;
  if (exact.delay == Delay::fit) exact.delay = Delay::none;
  const FitSetup setup = prepare_fit(response, exact);
  if (weights.size() != response.size())
    throw std::invalid_argument("hassul: " + std::to_string(weights.size()) + " weights for " +
                                std::to_string(response.size()) +
                                " points; give one weight per point");
  Refined refined{on_grid(setup.data, model, orders.k), 1, true};
  GridRational& rational = refined.rational;
  const Eigen::ArrayXd weight =
      Eigen::Map<const Eigen::ArrayXd>(weights.data(), static_cast<Index>(weights.size())) *
      rational.D.abs();
  rational.cost = whitened(setup.data, setup.data.known * rational.N / rational.D).squaredNorm();
  if (!std::isfinite(rational.cost) || !(weight.minCoeff() > 0.0))
    throw std::invalid_argument(
        "hassul: the model is not finite on the grid; lower the orders or check the units");
  rational.normalise();
  Fit fit = make_weighted_fit(setup, refined, weight / weight.maxCoeff());
  if (model.den.front() != 0.0 && model.den.size() == fit.model.den.size()) {
    fit.model = model;
    for (auto* coefficients : {&fit.model.num, &fit.model.den})
      for (double& each : *coefficients) each /= model.den.front();
    fit.model.delay_s = fit.zpk.delay_s;
  }
  return fit;
}

}  // namespace sinerig::identify
