// The report: one HTML file that needs nothing but a browser, on line or off.
#pragma once

#include <iosfwd>
#include <vector>

#include <nlohmann/json.hpp>

#include "report/drift.h"
#include "report/report_data.h"

namespace sinerig::report {

// `loop`: what a controller makes of the response, as cli/loop_panel.h has it; null for none.
void write_html(std::ostream& stream, const LabelledRun& run,
                const nlohmann::ordered_json& loop = {});

// Several runs over each other, with the differences against the first and the drift of models.
void write_html(std::ostream& stream, const std::vector<LabelledRun>& runs,
                const std::vector<record::Difference>& differences,
                const std::vector<Drift>& drifts = {});

}  // namespace sinerig::report
