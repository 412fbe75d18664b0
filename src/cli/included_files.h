// The files that a rig file leads to (a profile, a DBC): a run goes on with those it began with.
#pragma once

#include <string>

#include "config/rig.h"
#include "record/sweep_reader.h"

namespace sinerig::cli {

// A line of each: its digest and its path. What a sweep file keeps of them.
std::string included_text(const config::Rig& rig);

// The first that is not as it was when the run began; empty where all are. Files that do not say
// count as they are now.
std::string changed_include(const record::StoredRun& run, const config::Rig& rig);

// Throws config::ConfigError where one is not.
void refuse_changed_include(const record::StoredRun& run, const config::Rig& rig,
                            const std::string& sweep_file);

}  // namespace sinerig::cli
