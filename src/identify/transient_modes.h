// The modes of a plant from a short record of any motion, its transient included: no steady state
// has to be waited for.
#pragma once

#include <complex>
#include <vector>

#include <Eigen/Core>

namespace sinerig::identify {

// What was applied and what was seen, tick by tick; the input is held between ticks. An output that
// is not a number is missing.
struct MotionRecord {
  double period_s = 0.0;
  std::vector<double> input;
  std::vector<double> output;
};

struct ModeSettings {
  int most_poles = 14;
  // Ticks of dead time at most: the newest inputs act on their own beside the modes.
  int most_delay_ticks = 4;
  double lowest_hz = 0.0;  // where the record excites the plant
  double highest_hz = 0.0;
};

struct FoundModes {
  // rad/s; a pair by the pole of positive imaginary part.
  std::vector<std::complex<double>> poles;
  // Of (re, im) of the poles in their order, re alone for a real pole; infinite for a pole that the
  // record does not tell from the constant.
  Eigen::MatrixXd covariance;
  double noise_variance = 0.0;  // of the output
  double degrees_of_freedom = 0.0;
};

// y = Σ modes driven by u, their free motion, the newest inputs weighed one by one (dead time of
// any fraction of a tick), a constant. Poles by vector fitting in time (Gustavsen and Semlyen 1999,
// in discrete time), then by Gauss-Newton on the poles with everything linear solved for (Golub and
// Pereyra 1973). The number of poles is that of least N ln(RSS/N) + p ln N.
// Throws std::invalid_argument where the record is shorter than 100 ticks, input and output differ
// in length, or the input is constant.
FoundModes find_modes(const MotionRecord& record, const ModeSettings& settings);

}  // namespace sinerig::identify
