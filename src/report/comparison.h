// A comparison on a terminal.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "record/compare.h"
#include "report/drift.h"

namespace sinerig::report {

// Per difference a table of its points with the joint intervals, and a verdict. `first` names the
// file that the others are compared with.
void print_comparison(std::ostream& stream, const std::string& first,
                      const std::vector<record::Difference>& differences);

// {reference, changed, differences: [{name, compared, changed, lost, unmatched, unusable, points}],
// drift}.
nlohmann::ordered_json comparison_json(const std::string& first,
                                       const std::vector<record::Difference>& differences,
                                       const std::vector<Drift>& drifts);

}  // namespace sinerig::report
