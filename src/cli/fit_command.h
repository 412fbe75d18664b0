// sinerig fit: a measured response into a model.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "report/fit_report.h"

namespace sinerig::cli {

struct FitCommandOptions {
  std::vector<std::string> files;  // sweep files or CSV; several are fitted jointly
  std::string method = "ml";       // ml hassul choe
  std::optional<int> zeros;        // all zeros
  std::optional<int> poles;        // all poles, those at the origin included
  std::optional<int> origin;       // poles at the origin; negative: zeros
  std::string order;               // "auto" or empty: auto where an order is not given
  std::string delay = "fit";       // none, fit or seconds
  std::string hold = "auto";       // auto (of a sweep file), none or a rate in Hz
  double path_delay_s = 0.0;
  std::optional<double> static_gain;
  std::vector<double> given_poles_rad_s;  // real poles that are known
  std::optional<double> model_error;  // relative; default 0 for CSV, see fit_command.cpp for sweeps
  std::string weights = "none";       // hassul: none, 1/w, or W1,W2,… one per point
  int bands = 3;                      // choe
  bool stable = false;
  bool minimum_phase = false;
  bool keep_outliers = false;
  bool json = false;
  bool no_store = false;
  std::string channel;
};

// Fits what the options name; a fit of one sweep file is stored in it unless no_store is set.
// Throws as fit_command does.
report::FitReport fit_files(const FitCommandOptions& options);

// Prints the model; a fit of one sweep file is also stored in it. Throws std::invalid_argument,
// InputError and record::SweepFileError. Exit code 1 when the fit has not converged.
int fit_command(const FitCommandOptions& options);

}  // namespace sinerig::cli
