// The command line: parses, dispatches, turns exceptions into messages and exit codes.
#pragma once

#include <vector>

#include "drivers/device.h"

namespace sinerig::cli {

int run_app(int argc, char** argv, const std::vector<DriverKit>& drivers);

}  // namespace sinerig::cli
