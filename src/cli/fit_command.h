// sinerig fit: a measured response into a model.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/fit_weights.h"
#include "report/fit_report.h"

namespace sinerig::cli {

struct FitCommandOptions {
  std::vector<std::string> files;  // as read_fit_input takes them; several are fitted jointly
  std::string method = "ml";       // ml hassul choe
  std::optional<int> zeros;        // all zeros
  std::optional<int> poles;        // all poles, those at the origin included
  std::optional<int> origin;       // poles at the origin; negative: zeros
  std::string order;               // "auto" or empty: auto where an order is not given
  std::string delay;               // none, fit or seconds; empty: fit where the method can
  std::string hold = "auto";       // auto (of a sweep file), none or a rate in Hz
  double path_delay_s = 0.0;
  std::optional<double> static_gain;
  std::vector<double> given_poles_rad_s;  // real poles that are known
  // Relative; default 0 for CSV, for sweep files as little as explains the residual, see
  // fit_command.cpp.
  std::optional<double> model_error;
  WeightOptions weights;     // hassul
  std::optional<int> bands;  // choe; default: those of the sweep, or of the files, or 3
  std::string discrete;      // empty, tustin, zoh or matched
  double rate_hz = 0.0;      // of the discrete equivalent; 0: that of the loop
  double prewarp_hz = 0.0;   // tustin
  bool stable = false;
  // Fit again as if stable were set where the rig was driven in open loop and the free fit is
  // unstable: for fits that nobody looks at before they are used.
  bool stable_in_open_loop = false;
  bool minimum_phase = false;
  bool keep_outliers = false;
  bool json = false;
  bool no_store = false;
  bool trust_units = false;
  std::string channel;
};

// Fits what the options name; the fit is stored in every sweep file among them unless no_store is
// set.
// Throws as fit_command does.
report::FitReport fit_files(const FitCommandOptions& options);

// fit_files, and prints the model. Throws std::invalid_argument and
// record::SweepFileError. Exit code 1 when the fit has not converged.
int fit_command(const FitCommandOptions& options);

}  // namespace sinerig::cli
