// Runs against the first of them, response by response.
#pragma once

#include <string>
#include <vector>

#include "record/compare.h"
#include "report/report_data.h"

namespace sinerig::cli {

// The run with what it had planned and was ended before, as points that are not good; says so.
report::LabelledRun with_unmeasured(report::LabelledRun run);

// Each run after the first against the first, responses of the same name; two runs with one
// response each are compared whatever the names are.
std::vector<record::Difference> differences_of(const std::vector<report::LabelledRun>& runs,
                                               const record::CompareSettings& settings);

}  // namespace sinerig::cli
