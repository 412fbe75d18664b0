// State-space form of a model, continuous or sampled.
#pragma once

#include <complex>

#include <Eigen/Core>

#include "identify/transfer_function.h"

namespace sinerig::identify {

// x' = A x + B u(t − delay), y = C x + D u(t − delay); one input, one output. Time in s.
struct StateSpace {
  Eigen::MatrixXd A;
  Eigen::VectorXd B;
  Eigen::RowVectorXd C;
  double D = 0.0;
  double delay_s = 0.0;

  // G(jω).
  std::complex<double> at(double omega_rad_s) const;
};

// The chain of second_order_sections, each in a frequency scaled by its own poles, so that A holds
// rates and nothing larger; repeated poles and poles at the origin are no exception.
// Throws std::invalid_argument as second_order_sections does.
StateSpace to_state_space(const ZerosPolesGain& model);

// x[n+1] = A x[n] + B u[n], y[n] = C x[n] + D u[n], then whole ticks of delay.
struct SampledStateSpace {
  Eigen::MatrixXd A;
  Eigen::VectorXd B;
  Eigen::RowVectorXd C;
  double D = 0.0;
  double period_s = 0.0;
  int delay_ticks = 0;

  // H(exp(jωT)).
  std::complex<double> at(double omega_rad_s) const;
};

// Exact at the ticks for an input held over each period: A and B by the matrix exponential
// (Franklin, Powell and Workman, Digital Control of Dynamic Systems, section 4.3). Of the delay
// the whole ticks are counted; a fraction adds one state, the input of the tick before.
// Throws std::invalid_argument when period_s is not positive or the delay is negative.
SampledStateSpace zero_order_hold(const StateSpace& system, double period_s);

// exp(M) by scaling, a Taylor series and squaring; relative error about 1e-15 · |M|.
Eigen::MatrixXd matrix_exponential(const Eigen::MatrixXd& M);

}  // namespace sinerig::identify
