// The model of a plant that margins and notches start from: the fit stored in a sweep file, or a
// new one.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/fit_input.h"
#include "identify/fit.h"
#include "identify/loop_curve.h"

namespace sinerig::cli {

struct PlantModel {
  FitInput measured;
  identify::ZerosPolesGain zpk;
  std::vector<identify::Mode> modes;         // frequency, damping and pole only
  identify::RootCovariance root_covariance;  // of zpk

  // Relative scatter of G at any frequency.
  identify::Curve::Scatter scatter() const;
};

// FILE is what read_fit_input takes. Its latest maximum-likelihood fit is used; without one, or
// with refit, it is fitted first with `sinerig fit`'s defaults, and that is said (and stored in a
// sweep file). hold_hz: rate of the hold the file was measured behind, 0 for none, where the file
// does not say it or is wrong. A stored fit made with another hold is not used: the model has to be
// the bare plant; nor is one that good points of the file have joined since. Throws as fit_command
// does.
PlantModel read_plant_model(const std::string& file, const std::string& channel, bool refit,
                            std::optional<double> hold_hz = {}, bool trust_units = false);

}  // namespace sinerig::cli
