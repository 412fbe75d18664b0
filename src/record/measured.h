// Responses from whatever file they are in: a sweep file, or CSV, MATLAB and UFF 58 files measured
// elsewhere.
#pragma once

#include <string>
#include <vector>

#include "record/sweep_reader.h"

namespace sinerig::record {

// A response as another program wrote it. What the file does not say is NaN; points without a
// status have "imported". Scatter without degrees of freedom counts as exactly known (dof
// infinite), no scatter as unknown (dof 0).
struct ImportedResponse {
  ChannelInfo input;
  ChannelInfo output;
  std::vector<StoredPoint> points;  // by rising frequency, all above zero
  double hold_rate_hz = 0.0;        // of the hold between the two; 0: none, or not said
  std::size_t left_out = 0;         // points at no frequency above zero
};

// The fact of a run that says how many of a file's points had no usable frequency.
inline constexpr const char* left_out_fact = "left_out";

// A point with nothing in it yet.
StoredPoint imported_point();

// "NAME [UNIT]"; the brackets of a unit may hold others, as in V [rms]. Without them all is name.
ChannelInfo channel_from_text(const std::string& text);

// By extension: .csv or .txt, .mat, .uff or .unv. Throws SweepFileError naming file, place and
// rule.
std::vector<ImportedResponse> import_responses(const std::string& path);

// The same values as a run that has no plan, events or timing.
StoredRun run_of(const std::vector<ImportedResponse>& responses, const std::string& path);

// Whatever file it is: read_sweep for a sweep file, else run_of(import_responses).
StoredRun read_measured(const std::string& path);

}  // namespace sinerig::record
