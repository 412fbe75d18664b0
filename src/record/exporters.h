// A run as text for other programs.
#pragma once

#include <iosfwd>
#include <string>

#include "record/sweep_reader.h"

namespace sinerig::record {

// Remarks with channels, units and sign convention behind #, then the columns
// freq_hz,re,im,gain_db, phase_deg (phase unwrapped), covariance, figures of point_columns.h,
// status. One response, rising frequency; numbers round-trip, NaN is an empty field.
void write_csv(std::ostream& stream, const StoredRun& run, const StoredResponse& response);

// Everything but blocks and samples: facts, rig file, loop rate, plan, responses, events, timing.
void write_json(std::ostream& stream, const StoredRun& run);

}  // namespace sinerig::record
