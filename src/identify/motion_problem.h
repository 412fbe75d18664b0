// A recorded motion as a separable problem: linear in all but the poles of the plant that moved.
#pragma once

#include <complex>
#include <limits>
#include <vector>

#include <Eigen/Core>

#include "identify/transient_modes.h"

namespace sinerig::identify {

// The parameters of these poles: two of a pair, one of a real pole.
Eigen::Index order_of(const std::vector<std::complex<double>>& poles);

// Poles at which a motion was fitted, rad/s, and where Gauss-Newton goes from there.
struct MotionFit {
  std::vector<std::complex<double>> poles;
  double rss = std::numeric_limits<double>::infinity();
  Eigen::VectorXd step;        // of the poles' parameters
  Eigen::MatrixXd covariance;  // of them, for a noise of one; infinite where undetermined
};

class MotionProblem {
 public:
  // Missing outputs repeat the one before and count for nothing.
  MotionProblem(const MotionRecord& record, const ModeSettings& settings);

  // Outputs that count.
  double samples() const;

  // Poles to begin with: pairs spread over the band, and a real one where the order is odd.
  std::vector<std::complex<double>> spread(int order) const;

  // One step of vector fitting: the zeros of σ in σ y = Σ … become the poles.
  std::vector<std::complex<double>> relocated(const std::vector<std::complex<double>>& poles) const;

  // Gauss-Newton from these poles, as long as the residual falls.
  MotionFit refined(const std::vector<std::complex<double>>& poles) const;

 private:
  using Complex = std::complex<double>;

  Eigen::Index ticks() const { return input_.size(); }
  // Columns of the newest inputs and of the constant.
  Eigen::Index common() const { return settings_.most_delay_ticks + 2; }
  // Of all columns, the rows that count; the others zero.
  Eigen::MatrixXd counted_rows(const Eigen::MatrixXd& columns) const;
  Eigen::VectorXd counted_output() const;
  void put_modes(Eigen::MatrixXd& columns, Eigen::Index& column,
                 const std::vector<Complex>& poles) const;
  void put_common(Eigen::MatrixXd& columns, Eigen::Index& column) const;
  // By the parameters of the poles, at the solution of the linear columns.
  void put_derivatives(Eigen::MatrixXd& columns, Eigen::Index& column,
                       const std::vector<Complex>& poles, const Eigen::VectorXd& solution) const;
  Eigen::VectorXd least_squares(const Eigen::MatrixXd& columns) const;
  // Everything linear at these poles, and the step of the poles that Gauss-Newton takes from there.
  MotionFit fit(const std::vector<Complex>& poles) const;
  void find_step(const Eigen::MatrixXd& columns, MotionFit& fit) const;

  double period_s_;
  ModeSettings settings_;
  Eigen::VectorXd input_;
  Eigen::VectorXd output_;
  Eigen::VectorXd present_;
  Eigen::Index first_ = 0;
};

}  // namespace sinerig::identify
