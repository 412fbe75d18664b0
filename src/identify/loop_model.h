// A loop made of a plant model, a controller and notches, in continuous time or sampled.
#pragma once

#include <optional>
#include <vector>

#include "identify/loop_curve.h"
#include "identify/notch.h"
#include "identify/state_space.h"
#include "identify/transfer_function.h"

namespace sinerig::identify {

// kp + ki/s + kd·s/(1 + s/filter); without a filter (0) the derivative is pure.
ZerosPolesGain pid(double kp, double ki, double kd, double filter_rad_s);

// L = P·C·∏N with negative feedback. With a rate the controller runs as a program: P stands behind
// a zero-order hold and is read in the tick that writes, C is its Tustin equivalent, the notches
// their prewarped one. More delay of the loop (calculation, transport) adds to the plant's.
class LoopModel {
 public:
  // rate_hz 0: continuous. Throws std::invalid_argument with a rate for a plant that
  // to_state_space refuses or a controller that is not proper.
  LoopModel(ZerosPolesGain plant, ZerosPolesGain controller, double rate_hz = 0.0);

  LoopModel with(const Notch& notch) const;

  std::complex<double> at(double omega_rad_s) const;
  double rate_hz() const { return rate_hz_; }

  // 1 + L has no zero in the right half plane (outside the unit circle): the argument principle on
  // (1 + L)·∏(s − p)/(s − p*) with unstable open-loop poles p moved to stable p*, so that poles on
  // the axis need no detour.
  bool closed_loop_stable() const;

  // The highest frequency that has anything to say: half the rate, or far above every root.
  double highest_rad_s() const;

  // L with the relative scatter of the plant; the controller is exact. scatter: of the plant.
  // The range is that of the frequencies searched, cut below half the rate.
  Curve curve(double first_rad_s, double last_rad_s, const Curve::Scatter& scatter) const;

 private:
  std::complex<double> moved(double omega_rad_s) const;
  std::vector<std::complex<double>> open_loop_roots() const;

  ZerosPolesGain plant_;
  ZerosPolesGain controller_;
  std::vector<Notch> notches_;
  double rate_hz_;
  std::optional<SampledStateSpace> held_;
};

}  // namespace sinerig::identify
