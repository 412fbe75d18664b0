// Which of a run's responses a command is about.
#pragma once

#include <string>

#include "record/sweep_reader.h"

namespace sinerig::cli {

// The response of the named channel, the first where none is named. Throws record::SweepFileError
// naming `file` when there is none.
const record::StoredResponse& chosen_response(const record::StoredRun& run, const std::string& file,
                                              const std::string& channel);

}  // namespace sinerig::cli
