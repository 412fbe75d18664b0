// The arguments that say what closes the loop around a plant.
#pragma once

#include <CLI/CLI.hpp>

#include "cli/loop_options.h"

namespace sinerig::cli {

void add_loop_options(CLI::App& command, LoopOptions& options);

}  // namespace sinerig::cli
