// Pictures without a browser: the Bode plot of one response as SVG.
#pragma once

#include <iosfwd>

#include "record/sweep_reader.h"
#include "report/report_data.h"

namespace sinerig::report {

// Gain, phase and the half-widths of the intervals over log frequency, 960 by 860 pixels: 95 %
// bands, points by status, the models that the run holds.
void write_bode_svg(std::ostream& stream, const LabelledRun& run,
                    const record::StoredResponse& response);

}  // namespace sinerig::report
