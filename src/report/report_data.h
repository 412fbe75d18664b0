// What a report shows, as the JSON object that its page reads: runs, responses with intervals,
// models, differences. Numbers are cut to what a plot can show; exports hold them in full.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "record/compare.h"
#include "record/sweep_reader.h"

namespace sinerig::report {

struct LabelledRun {
  std::string label;  // unique among the runs of one report
  record::StoredRun run;
};

// A number to so many significant digits; null where there is none.
nlohmann::ordered_json rounded(double value, int digits);

// "encoder", or "gyro / encoder" where the input is not what was applied.
std::string response_name(const record::StoredRun& run, const record::StoredResponse& response);

// Unit of H: "rad/Nm", "(rad/s)/Nm", "1" where both channels have the same.
std::string response_unit(const record::StoredRun& run, const record::StoredResponse& response);

// The figures of points as columns, each named as the page knows it; every column has one entry per
// point, null where there is no number.
nlohmann::ordered_json point_columns(const std::vector<record::StoredPoint>& points);

// The page of one run.
nlohmann::ordered_json page_of_run(const LabelledRun& run);

// The page that lays several runs over each other; each difference is against the first.
nlohmann::ordered_json page_of_comparison(const std::vector<LabelledRun>& runs,
                                          const std::vector<record::Difference>& differences);

}  // namespace sinerig::report
