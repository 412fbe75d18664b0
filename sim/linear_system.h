// Continuous linear plants with dead time, from the four descriptions that a rig file can give.
#pragma once

#include <complex>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace sinerig::sim {

// x' = A x + b u(t − dead time), y = C x + d u(t − dead time); one input, one row of C per output.
struct LinearSystem {
  Eigen::MatrixXd a;
  Eigen::VectorXd b;
  Eigen::MatrixXd c;
  Eigen::VectorXd d;
  std::vector<std::string> outputs;  // a name per row of C
  double dead_time_s = 0.0;
  Eigen::RowVectorXd velocity;  // the velocity that friction acts on; empty where there is none
  Eigen::VectorXd force;        // x' of a unit force at that velocity, in the place of b

  Eigen::Index states() const { return a.rows(); }
};

// num(s) / den(s), descending powers; proper. Controllable canonical form in a scaled frequency,
// balanced. Throws std::invalid_argument.
LinearSystem from_transfer_function(const std::vector<double>& num, const std::vector<double>& den);

// gain · Π(s − z) / Π(s − p), rad/s. A complex entry stands for itself and its conjugate. A chain
// of second-order sections, which stays exact at high order. Throws std::invalid_argument.
LinearSystem from_zeros_poles(const std::vector<std::complex<double>>& zeros,
                              const std::vector<std::complex<double>>& poles, double gain);

// The matrices as they are, balanced. Throws std::invalid_argument on sizes that do not fit.
LinearSystem from_state_space(Eigen::MatrixXd a, Eigen::VectorXd b, Eigen::MatrixXd c,
                              Eigen::VectorXd d, std::vector<std::string> outputs);

struct FlexibleMode {
  double frequency_hz;
  double damping;  // ratio to critical
  double residue;  // of the position response: residue / (s² + 2ζωs + ω²), unit of 1/inertia
};

// A mechanical axis: (inertia s² + damping s + stiffness) x = gain · u, plus flexible modes.
// Outputs: "position" and "velocity".
struct MechanicalAxis {
  double inertia = 1.0;
  double damping = 0.0;
  double stiffness = 0.0;
  double gain = 1.0;  // force or torque per unit of the command
  std::vector<FlexibleMode> modes;
  double lag_hz = 0.0;  // first-order lag of the drive before the mechanics; 0 = none
};

LinearSystem from_mechanical_axis(const MechanicalAxis& axis);

}  // namespace sinerig::sim
