// sinerig margins: how far a loop is from instability, from measured points and from the model.
#pragma once

#include <string>

#include "cli/loop_options.h"

namespace sinerig::cli {

struct MarginsOptions {
  std::string file;                // what read_fit_input takes
  std::string response = "plant";  // what was measured: plant loop sensitivity complementary
  LoopOptions loop;
  bool negate = false;  // the response was measured with the other sign
  std::string channel;
  bool points_only = false;
  bool refit = false;
  bool json = false;
};

// Throws as fit_command does, and std::invalid_argument for a loop that cannot be built.
int margins_command(const MarginsOptions& options);

}  // namespace sinerig::cli
