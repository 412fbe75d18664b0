// What the files of one fit hold together, and what a fit makes of it whatever its method.
#pragma once

#include <array>
#include <vector>

#include "cli/fit_command.h"
#include "cli/fit_input.h"
#include "identify/fit.h"
#include "identify/response.h"

namespace sinerig::cli {

// Settling, quantisation and friction leave errors that repeat and so do not scatter at all; a fit
// weighted by the scatter alone would say that it knows the plant better than it does. The least of
// these relative errors that makes the residual what noise leaves is taken; the largest chooses the
// order. On config/gimbal.toml 1e-4 is enough: of 24 seeds every interval of frequency, damping and
// delay holds the truth, where the largest makes them twenty times too wide.
inline constexpr std::array<double, 5> sweep_model_errors{1e-4, 2e-4, 5e-4, 1e-3, 2e-3};

struct JointInput {
  std::vector<FitInput> inputs;
  identify::Response response;  // of all files
  double hold_period_s = 0.0;   // 0: none
  double model_error = 0.0;
  bool choose_model_error = false;  // the least that serves
};

// Reads the files of the options. Throws as read_fit_input does; std::invalid_argument for files of
// different loops.
JointInput read_joint_input(const FitCommandOptions& options);

// Without orders. Throws std::invalid_argument for a delay that is none.
identify::FitOptions fit_options(const FitCommandOptions& options, const JointInput& measured);

}  // namespace sinerig::cli
