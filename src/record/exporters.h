// A run as text for other programs.
#pragma once

#include <iosfwd>
#include <string>

#include "record/sweep_reader.h"

namespace sinerig::record {

// A line of column names: freq_hz,re,im,gain_db,phase_deg (unwrapped, a lag is negative), the
// covariance, the figures of point_columns.h, status, and last the channels with their units. Then
// the points of one response by rising frequency; numbers round-trip, NaN is an empty field.
void write_csv(std::ostream& stream, const StoredRun& run, const StoredResponse& response);

// Everything but blocks and samples: facts, rig file, loop rate, plan, responses, events, timing.
void write_json(std::ostream& stream, const StoredRun& run);

}  // namespace sinerig::record
