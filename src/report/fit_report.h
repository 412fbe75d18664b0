// A fitted model for people and for programs.
#pragma once

#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "identify/choe.h"
#include "identify/fit.h"
#include "identify/order.h"

namespace sinerig::report {

// What a fit command ended in; the paper's methods give a model only.
struct FitReport {
  std::string label;
  std::string method;  // ml hassul choe
  identify::Response response;
  double hold_period_s = 0.0;  // of the hold in front of the plant when it was measured, 0: none
  double path_delay_s = 0.0;   // of the measuring path, divided out before the fit
  identify::TransferFunction model;
  std::optional<identify::Fit> fit;
  std::optional<identify::ChoeFit> choe;
  std::vector<identify::OrderCandidate> table;  // empty where the order was given
};

// Model, modes, quality and the table of candidates as text.
void print_fit(std::ostream& stream, const FitReport& report);

// One JSON object: num and den in descending powers of s, poles at the origin included, delay_s,
// chi2, converged, standard errors, modes, …; null where a method has no such figure.
std::string fit_json(const FitReport& report);

}  // namespace sinerig::report
