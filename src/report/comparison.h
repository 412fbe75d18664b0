// A comparison on a terminal.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "record/compare.h"

namespace sinerig::report {

// Per difference a table of its points with the joint intervals, and a verdict. `first` names the
// file that the others are compared with.
void print_comparison(std::ostream& stream, const std::string& first,
                      const std::vector<record::Difference>& differences);

}  // namespace sinerig::report
