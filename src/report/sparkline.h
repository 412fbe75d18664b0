// A curve in braille dots, for terminals.
#pragma once

#include <string>
#include <vector>

namespace sinerig::report {

struct SparklinePoint {
  double x = 0.0;
  double y = 0.0;
};

// `columns` × `rows` characters, each of 2 × 4 dots; x from `left` to `right` and y from `low` to
// `high` over the outermost dots. Points that follow each other are joined; what is not finite or
// outside breaks the curve. One UTF-8 string per row, from the top; blanks are spaces.
std::vector<std::string> sparkline(const std::vector<SparklinePoint>& points, std::size_t columns,
                                   std::size_t rows, double left, double right, double low,
                                   double high);

}  // namespace sinerig::report
