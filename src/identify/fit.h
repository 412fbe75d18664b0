// What a fit is asked for and what it returns.
#pragma once

#include <complex>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "identify/response.h"
#include "identify/root_covariance.h"
#include "identify/transfer_function.h"

namespace sinerig::identify {

enum class Delay { none, known, fit };

struct FitOptions {
  int zeros = 0;   // all zeros, those at the origin included
  int poles = 1;   // all poles, those at the origin and those given included
  int origin = 0;  // poles at the origin; negative: zeros at the origin
  Delay delay = Delay::none;
  double delay_s = 0.0;  // with Delay::known
  // Delay of the measuring path, known and not part of the plant: divided out, not returned.
  double path_delay_s = 0.0;
  // Period of the loop whose zero-order hold drove the plant; 0: none. The model returned is the
  // continuous plant, the exact response behind the hold is what is compared with the data.
  double hold_period_s = 0.0;
  std::optional<double> static_gain;              // lim s^origin·G(s) at s = 0
  std::vector<std::complex<double>> given_poles;  // rad/s, in conjugate pairs, not at the origin
  // Relative floor added to the scatter, for what the model cannot say; the scatter itself where
  // the response has none.
  double model_error = 0.0;
  bool robust = true;          // look for outliers
  bool stable = false;         // poles kept in the left half plane
  bool minimum_phase = false;  // zeros kept in the left half plane
  int random_starts = 10;
  std::uint64_t seed = 1;
};

// A number with its standard error (one sigma, linearised at the minimum).
struct Estimate {
  double value = 0.0;
  double standard_error = 0.0;
};

// A pole or zero in rad/s with the covariance of its real and imaginary parts.
struct RootEstimate {
  std::complex<double> root;
  double variance_re = 0.0;
  double covariance = 0.0;
  double variance_im = 0.0;
};

// A pole of positive imaginary part, or a real one away from the origin (damping ±1).
struct Mode {
  Estimate frequency_hz;          // |pole|/2π
  Estimate damping;               // −re(pole)/|pole|
  std::complex<double> residue;   // of G without delay
  double residue_standard_error;  // of its complex value: sqrt of the trace of the covariance
  std::complex<double> pole;      // rad/s
};

// The fitted parameters in their own bases, for error bars of anything derived from them.
class ParameterCovariance;

struct Fit {
  TransferFunction model;  // den monic
  ZerosPolesGain zpk;      // the same; compute with this one
  std::vector<double> num_standard_error;
  std::vector<double> den_standard_error;
  // Of num, then den, then delay_s, in the order of `model`; the row of den[0] is zero.
  Eigen::MatrixXd covariance;
  RootCovariance root_covariance;  // of zpk
  Estimate delay_s;
  Estimate static_gain;  // lim s^origin·G(s) at s = 0
  std::vector<RootEstimate> poles;
  std::vector<RootEstimate> zeros;
  std::vector<Mode> modes;  // by rising frequency

  double chi2 = 0.0;           // Σ whitened residual² over the points kept
  int degrees_of_freedom = 0;  // 2 × points kept − free parameters
  double chi2_low = 0.0;       // 95 % interval of χ² when noise alone is left
  double chi2_high = 0.0;
  bool scatter_known = false;  // false: chi2 is in units of squared relative error, and the
                               // standard errors are scaled by chi2/degrees_of_freedom
  int free_parameters = 0;
  double model_error = 0.0;  // the floor that was added to the scatter
  double condition = 0.0;    // of the Jacobian with columns of size one
  int iterations = 0;        // of the nonlinear stage, over all starts
  bool converged = false;
  std::string reason;                 // why it ended
  std::vector<std::size_t> outliers;  // indices of the points left out
  std::shared_ptr<const ParameterCovariance> parameters;

  // G(jω) of the continuous model with the 2×2 covariance of (re, im).
  ResponsePoint response(double omega_rad_s) const;
};

}  // namespace sinerig::identify
