// The methods of `sinerig fit`: which options each can keep to, and the fit.
#pragma once

#include "cli/joint_input.h"
#include "report/fit_report.h"

namespace sinerig::cli {

// Method ml, the orders chosen where they are not given. Throws std::invalid_argument for options
// of the other methods.
void fit_by_likelihood(const FitCommandOptions& options, const JointInput& measured,
                       report::FitReport& report);

// Methods hassul and choe. Throws std::invalid_argument where the orders are not given and for
// options that they cannot keep to.
void fit_by_paper(const FitCommandOptions& options, const JointInput& measured,
                  report::FitReport& report);

}  // namespace sinerig::cli
