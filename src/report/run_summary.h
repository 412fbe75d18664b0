// A run in words: what stands at the top of a report, and its tables of facts, events and timing.
#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "record/sweep_reader.h"

namespace sinerig::report {

struct LabelledRun;

// "2026-03-01 22:14 UTC, 1000 Hz loop, virtual clock, on bench3, sinerig 0.1.0".
std::string about_run(const record::StoredRun& run);

// done, stopped …; "not finished" where the run was killed or goes on; empty for an import, which
// is no run.
std::string outcome_of(const record::StoredRun& run);

// The same and why.
std::string outcome_text(const record::StoredRun& run);

// [[name, value, remark], …]: points, range, peak, intervals, bench time, loop.
nlohmann::ordered_json summary_facts(const record::StoredRun& run);

// {label, facts, rig_name, rig_text, rate_hz, events, timing}. The start of each dwell is no event
// for people and left out.
nlohmann::ordered_json run_json(const LabelledRun& run);

}  // namespace sinerig::report
