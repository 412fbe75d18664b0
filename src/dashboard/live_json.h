// The messages of the live page as JSON, in the words that the page of a report uses.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "dashboard/running_estimate.h"
#include "dashboard/scope.h"
#include "record/sweep_reader.h"

namespace sinerig::dashboard {

using Json = nlohmann::ordered_json;

// One line; bytes that are no UTF-8 are replaced.
std::string text_of(const Json& json);

// The page's data without a point: what a report has, and `id`, `range` (Hz), `dwells`, `least_s`,
// `most_s`, `channels`, `pairs` (input and output channel of each response).
Json head_json(const std::string& label, const record::StoredRun& run, const std::string& id,
               bool in_real_time);

// {responses: [{r, columns…}], timing: {f, late_us, histogram}, events}. `added`: the dwells that
// follow those of the plan.
Json log_json(const std::vector<Record>& entries, const record::StoredRun& run,
              const std::vector<Dwell>& added);

Json headroom_json(const std::vector<Headroom>& rows);
Json trace_json(const Scope::Trace& trace);
Json estimate_json(const std::optional<RunningEstimate::Value>& value);

}  // namespace sinerig::dashboard
