// The options of `sinerig fit` on the command line.
#pragma once

#include <CLI/CLI.hpp>

#include "cli/fit_command.h"

namespace sinerig::cli {

// Adds the command; parsing fills `options`, which must outlive `app`.
CLI::App* add_fit(CLI::App& app, FitCommandOptions& options);

}  // namespace sinerig::cli
