#include "identify/levenberg_marquardt.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>

namespace sinerig::identify {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// On gimbal b 4 to 8 steps in one basis cost no iteration against renewing it at each.
constexpr int steps_per_basis = 6;
constexpr double first_damping = 1e-3;
constexpr double largest_damping = 1e9;
constexpr double negligible_decrease = 1e-9;

}  // namespace

Refined refine(const FitData& data, const Freedom& freedom, const GridRational& start,
               int most_iterations) {
  Refined refined{start, 0, false};
  if (freedom.parameters() == 0) {
    LocalModel only(data, freedom, start);
    refined.rational = only.on_grid();
    refined.rational.cost = only.residual(only.parameters()).squaredNorm();
    refined.converged = true;
    return refined;
  }
  double damping = first_damping;
  while (refined.iterations < most_iterations && !refined.converged) {
    LocalModel model(data, freedom, refined.rational);
    VectorXd residual = model.residual(model.parameters());
    double cost = residual.squaredNorm();
    if (!std::isfinite(cost)) {
      refined.rational.cost = std::numeric_limits<double>::infinity();
      break;
    }
    for (int accepted = 0; accepted < steps_per_basis && !refined.converged; ++accepted) {
      const MatrixXd J = model.jacobian();
      MatrixXd JtJ = MatrixXd::Zero(J.cols(), J.cols());
      JtJ.selfadjointView<Eigen::Lower>().rankUpdate(J.transpose());
      const VectorXd gradient = J.transpose() * residual;
      const VectorXd diagonal = JtJ.diagonal().cwiseMax(JtJ.diagonal().maxCoeff() * 1e-14);
      double growth = 2.0;
      bool moved = false;
      while (!moved && refined.iterations < most_iterations) {
        ++refined.iterations;
        MatrixXd damped = JtJ;
        damped.diagonal() += damping * diagonal;
        const VectorXd step = -damped.selfadjointView<Eigen::Lower>().llt().solve(gradient);
        const double predicted = step.dot(damping * diagonal.cwiseProduct(step) - gradient);
        const LocalModel::Parameters next = model.stepped(step);
        const VectorXd next_residual = model.residual(next);
        const double next_cost = next_residual.squaredNorm();
        const double ratio = (cost - next_cost) / predicted;
        if (std::isfinite(next_cost) && next_cost < cost) {
          moved = true;
          damping *= ratio > 0.75 ? 0.1 : std::max(1.0 / 3.0, 1.0 - std::pow(2.0 * ratio - 1.0, 3));
          damping = std::max(damping, 1e-12);
          refined.converged = cost - next_cost <= negligible_decrease * cost &&
                              predicted <= negligible_decrease * cost;
          model.move_to(next);
          residual = next_residual;
          cost = next_cost;
        } else if (predicted <= negligible_decrease * cost || damping > largest_damping) {
          refined.converged = true;
          break;
        } else {
          damping *= growth;
          growth *= 2.0;
        }
      }
      if (!moved) break;
    }
    refined.rational = model.on_grid();
    refined.rational.cost = cost;
  }
  return refined;
}

}  // namespace sinerig::identify
