// The report: one HTML file that needs nothing but a browser, on line or off.
#pragma once

#include <iosfwd>
#include <vector>

#include "report/report_data.h"

namespace sinerig::report {

void write_html(std::ostream& stream, const LabelledRun& run);

// Several runs over each other, with the differences against the first.
void write_html(std::ostream& stream, const std::vector<LabelledRun>& runs,
                const std::vector<record::Difference>& differences);

}  // namespace sinerig::report
