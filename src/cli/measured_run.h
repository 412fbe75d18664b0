// Any file of responses as a run, and what its reading has to say.
#pragma once

#include <string>

#include "record/sweep_reader.h"

namespace sinerig::cli {

// Throws record::SweepFileError: what it is told of a folder misleads.
void refuse_folder(const std::string& path);

// record::read_measured; warns of points that were left out. Throws as it does.
record::StoredRun read_run(const std::string& path);

// "encoder", or "encoder/torque" where one output has several inputs: whether the response is
// meant.
bool is_named(const record::StoredRun& run, const record::StoredResponse& response,
              const std::string& channel);

// The names that is_named goes by, each after a blank, for messages.
std::string names_of_responses(const record::StoredRun& run);

}  // namespace sinerig::cli
