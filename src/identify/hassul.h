// Linear least squares on 1/G, after Hassul and Shahian (IEEE Trans. on Education 35(4), 1992) as
// restated by Choe, "A Simple Method for Frequency Domain Identification", eqs. (1) to (13).
#pragma once

#include <vector>

#include <Eigen/Core>

#include "identify/response.h"
#include "identify/transfer_function.h"

namespace sinerig::identify {

// (jω)^k G = A/B, A = 1 + a1·jω + … + am·(jω)^m, B = b0 + … + bn·(jω)^n.
struct HassulOrders {
  int n = 1;  // degree of B; poles at the origin are counted in k only
  int m = 0;  // degree of A; zeros at the origin are counted in k only
  int k = 0;  // poles (k > 0) or zeros (k < 0) at the origin
};

// The system of eq. (10), ΩP = V, rows weighted as in eq. (12).
// P = [b_even | b_odd | a_even | a_odd]: b0 b2 …, b1 b3 …, a2 a4 …, a1 a3 ….
struct HassulSystem {
  Eigen::MatrixXd Omega;  // 2g × (n+m+1): [Ω1 0 Ω2 Ω3; 0 Ω4 Ω5 Ω6]
  Eigen::VectorXd V;      // 2g: R over X
};

// The weights W(i,i) of eq. (12), one per point, for the R and the X row alike.
std::vector<double> unit_weights(const Response& response);
std::vector<double> inverse_frequency_weights(const Response& response);                  // 1/ω
std::vector<double> weights_from(const TransferFunction& W_a, const Response& response);  // |W_a|

// Builds Ω1 … Ω6 with the corrected signs: the term a_2l carries (−1)^(l+1) in both (7) and (8),
// a_(2l+1) carries (−1)^l in (7) and (−1)^(l+1) in (8), [·] is floor, and R, X are those of
// (jω)^k G. omega_scale_rad_s divides ω, so that the columns do not overflow; 1 gives the paper's.
// Throws std::invalid_argument when weights do not match the points or are not positive.
HassulSystem hassul_system(const Response& response, const HassulOrders& orders,
                           const std::vector<double>& weights, double omega_scale_rad_s = 1.0);

// The model G = A/(B·s^k) that minimises |W(ΩP − V)|², by column-scaled QR, with the
// paper's normalisation a0 = 1. No delay.
// Throws std::invalid_argument for impossible orders, too few points (2g < n+m+1) or bad points.
TransferFunction fit_hassul(const Response& response, const HassulOrders& orders,
                            const std::vector<double>& weights);

// The same through the normal equations, eqs. (11) and (13): the condition number squares.
TransferFunction fit_hassul_normal_equations(const Response& response, const HassulOrders& orders,
                                             const std::vector<double>& weights);

}  // namespace sinerig::identify
