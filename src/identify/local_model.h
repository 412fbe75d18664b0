// A rational model with delay in bases that are orthonormal at one of its own values: the residual,
// its Jacobian, and steps in the free parameters.
#pragma once

#include <optional>

#include <Eigen/Core>

#include "identify/fit_data.h"
#include "identify/linear_stage.h"
#include "identify/orthonormal_basis.h"

namespace sinerig::identify {

class HoldModel;

// What a fit is free to change.
struct Freedom {
  Degrees degrees;
  bool delay = false;          // the delay is a parameter …
  double least_delay_s = 0.0;  // … kept between these
  double largest_delay_s = 0.0;
  // N(0)/D(0) kept at this value: the static gain without the known factors.
  std::optional<double> static_ratio;
  bool stable_poles = false;
  bool stable_zeros = false;
  const HoldModel* hold = nullptr;  // exact hold inside the model; null: known carries it

  int parameters() const {
    return degrees.numerator + degrees.denominator + 1 + (delay ? 1 : 0) - (static_ratio ? 1 : 0);
  }
};

// N = Σ n_k P_k, D = Σ d_k Q_k and a delay. Full parameter vector: n, d, delay·scale.
// Free parameters: without the largest d (the common factor is a gauge), without the n that a given
// static gain decides, without the delay when it is known.
class LocalModel {
 public:
  LocalModel(const FitData& data, const Freedom& freedom, const GridRational& at);

  struct Parameters {
    Eigen::VectorXd n;
    Eigen::VectorXd d;
    double delay_s = 0.0;
  };
  const Parameters& parameters() const { return parameters_; }
  const OrthonormalBasis& N_basis() const { return N_basis_; }
  const OrthonormalBasis& D_basis() const { return D_basis_; }

  // At the current parameters, the hold of the freedom included.
  Eigen::ArrayXcd response() const { return response(parameters_); }

  // Whitened residual, 2g real values; infinite when a constraint on the roots is broken.
  Eigen::VectorXd residual(const Parameters& parameters) const;

  // d residual / d free parameters at the current parameters, 2g × free.
  Eigen::MatrixXd jacobian() const;

  // parameters() + a step in the free parameters, the delay kept in its interval.
  Parameters stepped(const Eigen::VectorXd& step) const;
  void move_to(const Parameters& parameters) { parameters_ = parameters; }

  // d full / d free: carries covariances over to n, d and delay·scale.
  Eigen::MatrixXd spread_to_full() const;

  // The values on the grid, for another basis.
  GridRational on_grid() const;

 private:
  Eigen::ArrayXcd response(const Parameters& parameters) const;
  bool roots_allowed(const Parameters& parameters) const;
  void add_hold_sensitivity(Eigen::MatrixXd& J) const;
  int numerator_column(int k) const;
  int denominator_column(int k) const;
  int free_numerators() const;

  const FitData& data_;
  const Freedom freedom_;
  OrthonormalBasis D_basis_;
  OrthonormalBasis N_basis_;
  Parameters parameters_;
  int gauge_ = 0;       // index of the d that is not free
  int dependent_ = -1;  // index of the n that the static gain decides, or −1
  Eigen::VectorXd N_at_zero_;
  Eigen::VectorXd D_at_zero_;
};

}  // namespace sinerig::identify
