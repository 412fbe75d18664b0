#include "report/sparkline.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

namespace sinerig::report {

namespace {

// U+2800 and the dots of a braille character: bit of the dot in row r, column c.
constexpr unsigned braille = 0x2800;
constexpr std::array<std::array<unsigned, 2>, 4> dot_bits{
    {{0x01, 0x08}, {0x02, 0x10}, {0x04, 0x20}, {0x40, 0x80}}};

std::string utf8(unsigned code) {
  return {static_cast<char>(0xE0U | code >> 12U), static_cast<char>(0x80U | (code >> 6U & 0x3FU)),
          static_cast<char>(0x80U | (code & 0x3FU))};
}

class Canvas {
 public:
  Canvas(std::size_t columns, std::size_t rows) : columns_{columns}, cells_(columns * rows) {}

  void set(long x, long y) {
    const auto column = static_cast<std::size_t>(x / 2);
    const auto row = static_cast<std::size_t>(y / 4);
    cells_[row * columns_ + column] |=
        dot_bits[static_cast<std::size_t>(y % 4)][static_cast<std::size_t>(x % 2)];
  }

  void line(long x0, long y0, long x1, long y1) {
    const long steps = std::max({std::labs(x1 - x0), std::labs(y1 - y0), 1L});
    for (long i = 0; i <= steps; ++i) {
      const double part = static_cast<double>(i) / static_cast<double>(steps);
      set(x0 + std::lround(part * static_cast<double>(x1 - x0)),
          y0 + std::lround(part * static_cast<double>(y1 - y0)));
    }
  }

  std::vector<std::string> rows() const {
    std::vector<std::string> all(cells_.size() / columns_);
    for (std::size_t i = 0; i < cells_.size(); ++i)
      all[i / columns_] += cells_[i] == 0 ? " " : utf8(braille + cells_[i]);
    return all;
  }

 private:
  std::size_t columns_;
  std::vector<unsigned> cells_;
};

}  // namespace

std::vector<std::string> sparkline(const std::vector<SparklinePoint>& points, std::size_t columns,
                                   std::size_t rows, double left, double right, double low,
                                   double high) {
  if (columns == 0 || rows == 0) return {};
  Canvas canvas{columns, rows};
  const auto width = static_cast<double>(2 * columns - 1);
  const auto height = static_cast<double>(4 * rows - 1);
  bool joined = false;
  long x0 = 0;
  long y0 = 0;
  for (const SparklinePoint& point : points) {
    const double part_x = right > left ? (point.x - left) / (right - left) : 0.5;
    const double part_y = high > low ? (point.y - low) / (high - low) : 0.5;
    if (!(part_x >= 0.0 && part_x <= 1.0 && part_y >= 0.0 && part_y <= 1.0)) {
      joined = false;
      continue;
    }
    const long x = std::lround(part_x * width);
    const long y = std::lround((1.0 - part_y) * height);
    if (joined) {
      canvas.line(x0, y0, x, y);
    } else {
      canvas.set(x, y);
    }
    joined = true;
    x0 = x;
    y0 = y;
  }
  return canvas.rows();
}

}  // namespace sinerig::report
