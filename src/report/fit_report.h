// A fitted model for people and for programs.
#pragma once

#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "identify/choe.h"
#include "identify/discrete.h"
#include "identify/fit.h"
#include "identify/order.h"

namespace sinerig::report {

// A discrete equivalent of the model, where one was asked for.
struct DiscreteEquivalent {
  std::string method;  // tustin zoh matched
  double period_s = 0.0;
  double prewarp_rad_s = 0.0;  // tustin
};

// What a fit command ended in.
struct FitReport {
  std::string label;
  std::string method;           // ml hassul choe
  identify::Response response;  // as measured
  double hold_period_s = 0.0;   // of the hold in front of the plant when it was measured, 0: none
  double path_delay_s = 0.0;    // of the measuring path, divided out before the fit
  identify::Fit fit;
  std::optional<identify::ChoeFit> choe;
  std::optional<DiscreteEquivalent> discrete;
  std::vector<identify::OrderCandidate> table;  // empty where the order was given
};

// Model, modes, quality and the table of candidates as text.
void print_fit(std::ostream& stream, const FitReport& report);

// The model that the report asks for. Throws std::invalid_argument as the conversions do.
identify::DiscreteModel discrete_equivalent(const DiscreteEquivalent& wanted,
                                            const identify::ZerosPolesGain& model);

// One JSON object: num and den in descending powers of s, poles at the origin included, delay_s,
// chi2, converged, standard errors, modes, sections, state space, …; docs/fitting.md lists the
// keys.
std::string fit_json(const FitReport& report);

}  // namespace sinerig::report
