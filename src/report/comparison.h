// A comparison in words, on a terminal and as JSON.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "record/compare.h"
#include "report/drift.h"

namespace sinerig::report {

// "changed: 3 of 40 points by more than their scatter explains; 2 were good and are not any more".
std::string verdict(const record::Difference& difference);
// The same in a few words, without what is left out: "3 of 40 points changed".
std::string brief_verdict(const record::Difference& difference);
// What the verdict begins with: changed, same, nothing compared.
const char* verdict_word(const record::Difference& difference);

// Those of the files after the first of which no point could be compared.
std::vector<std::string> files_without_points(const std::vector<std::string>& files,
                                              const std::vector<record::Difference>& differences);

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
