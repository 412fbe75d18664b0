#include "identify/hassul.h"

#include <cmath>
#include <functional>
#include <stdexcept>
#include <string>

#include <Eigen/Cholesky>
#include <Eigen/QR>

namespace sinerig::identify {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;

double alternating(Index l) {
  return l % 2 == 0 ? 1.0 : -1.0;
}

// Sizes of the partition of P; [·] of the paper is floor, so m = 0 has no a_odd.
struct Partition {
  Index b_even, b_odd, a_even, a_odd;
  explicit Partition(const HassulOrders& orders)
      : b_even(orders.n / 2 + 1),
        b_odd((orders.n + 1) / 2),
        a_even(orders.m / 2),
        a_odd((orders.m + 1) / 2) {}
  Index unknowns() const { return b_even + b_odd + a_even + a_odd; }
};

void check(const Response& response, const HassulOrders& orders,
           const std::vector<double>& weights) {
  if (orders.n < 0 || orders.m < 0 || orders.n > 40 || orders.m > 40)
    throw std::invalid_argument("hassul: n = " + std::to_string(orders.n) +
                                ", m = " + std::to_string(orders.m) +
                                "; both orders must be between 0 and 40");
  const auto unknowns = static_cast<std::size_t>(orders.n + orders.m + 1);
  check_response(response, (unknowns + 1) / 2);
  if (weights.size() != response.size())
    throw std::invalid_argument("hassul: " + std::to_string(weights.size()) + " weights for " +
                                std::to_string(response.size()) +
                                " points; give one weight per point");
  for (std::size_t i = 0; i < weights.size(); ++i)
    if (!std::isfinite(weights[i]) || weights[i] <= 0.0)
      throw std::invalid_argument("hassul: weight " + std::to_string(i + 1) +
                                  " must be finite and above zero; correct it");
}

double centre_frequency(const Response& response) {
  return std::sqrt(response.front().omega_rad_s) * std::sqrt(response.back().omega_rad_s);
}

Complex power_of_s(double omega, int k) {
  static constexpr Complex turns[] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
  return turns[((k % 4) + 4) % 4] * std::pow(omega, k);
}

TransferFunction model_from(const Eigen::VectorXd& P, const HassulOrders& orders, double scale) {
  const Partition part(orders);
  const double gain_of_s_to_k = std::pow(scale, orders.k);
  std::vector<double> num(static_cast<std::size_t>(orders.m + 1));
  std::vector<double> den(static_cast<std::size_t>(orders.n + 1));
  for (int i = 0; i <= orders.n; ++i) {
    const double b = i % 2 == 0 ? P[i / 2] : P[part.b_even + i / 2];
    den[static_cast<std::size_t>(orders.n - i)] = b / (std::pow(scale, i) * gain_of_s_to_k);
  }
  num.back() = 1.0;
  const Index a_even_at = part.b_even + part.b_odd;
  const Index a_odd_at = a_even_at + part.a_even;
  for (int i = 1; i <= orders.m; ++i) {
    const double a = i % 2 == 0 ? P[a_even_at + i / 2 - 1] : P[a_odd_at + i / 2];
    num[static_cast<std::size_t>(orders.m - i)] = a / std::pow(scale, i);
  }
  std::vector<double>& with_origin = orders.k >= 0 ? den : num;
  with_origin.resize(with_origin.size() + static_cast<std::size_t>(std::abs(orders.k)), 0.0);
  return {num, den, 0.0};
}

using Solver = std::function<Eigen::VectorXd(const Eigen::MatrixXd&, const Eigen::VectorXd&)>;

TransferFunction fit_with(const Solver& solve, const Response& response, const HassulOrders& orders,
                          const std::vector<double>& weights) {
  check(response, orders, weights);
  const double scale = centre_frequency(response);
  HassulSystem system = hassul_system(response, orders, weights, scale);
  const double size_of_V = system.V.norm();
  const Eigen::VectorXd column_size = system.Omega.colwise().norm();
  system.Omega *= column_size.cwiseInverse().asDiagonal();
  const Eigen::VectorXd scaled = solve(system.Omega, system.V / size_of_V);
  return model_from(scaled.cwiseQuotient(column_size) * size_of_V, orders, scale);
}

}  // namespace

std::vector<double> unit_weights(const Response& response) {
  return std::vector<double>(response.size(), 1.0);
}

std::vector<double> inverse_frequency_weights(const Response& response) {
  std::vector<double> weights;
  weights.reserve(response.size());
  for (const ResponsePoint& point : response) weights.push_back(1.0 / point.omega_rad_s);
  return weights;
}

std::vector<double> weights_from(const TransferFunction& W_a, const Response& response) {
  std::vector<double> weights;
  weights.reserve(response.size());
  for (const ResponsePoint& point : response)
    weights.push_back(std::abs(W_a.at(point.omega_rad_s)));
  return weights;
}

HassulSystem hassul_system(const Response& response, const HassulOrders& orders,
                           const std::vector<double>& weights, double omega_scale_rad_s) {
  check(response, orders, weights);
  const Partition part(orders);
  const auto g = static_cast<Index>(response.size());
  const Index b_odd_at = part.b_even;
  const Index a_even_at = b_odd_at + part.b_odd;
  const Index a_odd_at = a_even_at + part.a_even;
  HassulSystem system{Eigen::MatrixXd::Zero(2 * g, part.unknowns()), Eigen::VectorXd(2 * g)};
  for (Index i = 0; i < g; ++i) {
    const ResponsePoint& point = response[static_cast<std::size_t>(i)];
    const double omega = point.omega_rad_s / omega_scale_rad_s;
    const Complex inverse = 1.0 / (power_of_s(omega, orders.k) * point.response);
    const double R = inverse.real();
    const double X = inverse.imag();
    const auto even_power = [&](Index l) {
      return std::pow(omega, static_cast<double>(2 * l));
    };
    for (Index l = 0; l < part.b_even; ++l) system.Omega(i, l) = alternating(l) * even_power(l);
    for (Index l = 0; l < part.b_odd; ++l)
      system.Omega(g + i, b_odd_at + l) = alternating(l) * even_power(l) * omega;
    for (Index l = 1; l <= part.a_even; ++l) {
      const double term = alternating(l + 1) * even_power(l);
      system.Omega(i, a_even_at + l - 1) = term * R;
      system.Omega(g + i, a_even_at + l - 1) = term * X;
    }
    for (Index l = 0; l < part.a_odd; ++l) {
      const double term = even_power(l) * omega;
      system.Omega(i, a_odd_at + l) = alternating(l) * term * X;
      system.Omega(g + i, a_odd_at + l) = alternating(l + 1) * term * R;
    }
    system.V[i] = R;
    system.V[g + i] = X;
    const double weight = weights[static_cast<std::size_t>(i)];
    for (const Index row : {i, g + i}) {
      system.Omega.row(row) *= weight;
      system.V[row] *= weight;
    }
  }
  return system;
}

TransferFunction fit_hassul(const Response& response, const HassulOrders& orders,
                            const std::vector<double>& weights) {
  const Solver by_qr = [](const Eigen::MatrixXd& Omega, const Eigen::VectorXd& V) {
    return Eigen::VectorXd(Omega.colPivHouseholderQr().solve(V));
  };
  return fit_with(by_qr, response, orders, weights);
}

TransferFunction fit_hassul_normal_equations(const Response& response, const HassulOrders& orders,
                                             const std::vector<double>& weights) {
  const Solver by_normal_equations = [](const Eigen::MatrixXd& Omega, const Eigen::VectorXd& V) {
    return Eigen::VectorXd((Omega.transpose() * Omega).ldlt().solve(Omega.transpose() * V));
  };
  return fit_with(by_normal_equations, response, orders, weights);
}

}  // namespace sinerig::identify
