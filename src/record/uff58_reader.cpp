#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <numbers>

#include "record/uff58.h"
#include "record/utf8.h"

namespace sinerig::record {

namespace {

constexpr int frequency_response = 4;

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t\r\n");
  if (first == std::string::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r\n") - first + 1);
}

std::string column(const std::string& line, std::size_t from, std::size_t width) {
  return from < line.size() ? trimmed(line.substr(from, width)) : std::string{};
}

// Lines of one dataset with the number of the first, for messages.
struct Dataset {
  std::string path;
  std::size_t first_line = 0;
  std::vector<std::string> lines;

  [[noreturn]] void refuse(std::size_t line, const std::string& what) const {
    throw SweepFileError(path + ":" + std::to_string(first_line + line) + ": " + what);
  }

  int integer(std::size_t line, std::size_t from, std::size_t width) const {
    return static_cast<int>(number(line, from, width));
  }

  double number(std::size_t line, std::size_t from, std::size_t width) const {
    std::string field = column(lines.at(line), from, width);
    std::replace(field.begin(), field.end(), 'D', 'E');
    char* end = nullptr;
    const double value = std::strtod(field.c_str(), &end);
    if (field.empty() || *end != '\0') refuse(line, "\"" + field + "\" is not a number");
    return value;
  }
};

// How the numbers of record 12 stand: ordinate type 2, 4, 5, 6; even or uneven abscissa.
struct Layout {
  bool complex = false;
  bool is_double = false;
  bool uneven = false;

  std::vector<std::size_t> widths() const {
    const std::size_t value = is_double ? 20 : 13;
    std::vector<std::size_t> one;
    if (uneven) one.push_back(13);
    one.push_back(value);
    if (complex) one.push_back(value);
    return one;
  }
  // Groups of one abscissa and ordinate in a line of 80 columns.
  std::size_t per_line() const {
    if (!is_double) return 6 / widths().size();
    if (!uneven) return complex ? 2 : 4;
    return complex ? 1 : 2;
  }
};

Layout layout_of(const Dataset& data) {
  const int type = data.integer(6, 0, 10);
  if (type != 2 && type != 4 && type != 5 && type != 6)
    data.refuse(6, "ordinate type " + std::to_string(type) + "; it has to be 2, 4, 5 or 6");
  return {.complex = type >= 5,
          .is_double = type == 4 || type == 6,
          .uneven = data.integer(6, 20, 10) == 0};
}

// "NAME [UNIT]" behind a key in one of the five identification lines, else label and unit of an
// axis.
ChannelInfo channel_of(const Dataset& data, const std::string& key, std::size_t axis_line) {
  const auto none = [](const std::string& text) {
    return text == "NONE" ? std::string{} : text;
  };
  ChannelInfo channel{none(column(data.lines[axis_line], 26, 20)),
                      none(column(data.lines[axis_line], 47, 20))};
  for (std::size_t i = 0; i < 5; ++i) {
    const std::string line = trimmed(data.lines[i]);
    if (line.rfind(key, 0) == 0 && line.back() == ']')
      channel = channel_from_text(line.substr(key.size()));
  }
  return {as_utf8(channel.name), as_utf8(channel.unit)};
}

// As the writer puts it into the first identification line; 0 where it is not there.
double hold_rate_of(const std::string& line) {
  constexpr const char* key = "sinerig hold_rate_hz=";
  if (line.rfind(key, 0) != 0) return 0.0;
  const double rate_hz = std::strtod(line.c_str() + std::string{key}.size(), nullptr);
  return rate_hz > 0.0 && std::isfinite(rate_hz) ? rate_hz : 0.0;
}

std::vector<StoredPoint> points_of(const Dataset& data) {
  const Layout layout = layout_of(data);
  const auto count = static_cast<std::size_t>(data.integer(6, 10, 10));
  const double first = data.number(6, 30, 13);
  const double increment = data.number(6, 43, 13);
  const bool in_radians = column(data.lines[7], 47, 20).find("rad") != std::string::npos;
  const double to_hz = in_radians ? 0.5 / std::numbers::pi : 1.0;
  const std::vector<std::size_t> widths = layout.widths();
  std::vector<StoredPoint> points;
  std::size_t line = 11;
  std::size_t from = 0;
  std::size_t in_line = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (in_line == layout.per_line()) {
      ++line;
      from = in_line = 0;
    }
    if (line >= data.lines.size()) data.refuse(line - 1, "the data end before the last point");
    std::array<double, 3> values{};
    for (std::size_t k = 0; k < widths.size(); ++k) {
      values.at(k) = data.number(line, from, widths[k]);
      from += widths[k];
    }
    ++in_line;
    const std::size_t at = layout.uneven ? 1 : 0;
    const double abscissa = layout.uneven ? values[0] : first + static_cast<double>(i) * increment;
    StoredPoint point = imported_point();
    point.frequency_hz = abscissa * to_hz;
    point.response = {values.at(at), layout.complex ? values.at(at + 1) : 0.0};
    points.push_back(point);
  }
  return points;
}

}  // namespace

std::vector<ImportedResponse> read_uff58(const std::string& path) {
  std::ifstream stream{path, std::ios::binary};
  if (!stream) throw SweepFileError(path + ": cannot be read");
  std::vector<ImportedResponse> responses;
  std::string line;
  std::size_t number = 0;
  const auto next = [&] {
    ++number;
    return static_cast<bool>(std::getline(stream, line));
  };
  while (next()) {
    if (trimmed(line) != "-1" || !next()) continue;
    const std::string kind = trimmed(line);
    if (kind.rfind("58b", 0) == 0) {
      throw SweepFileError(path + ":" + std::to_string(number) +
                           ": binary dataset 58b; have it written as ASCII");
    }
    Dataset data{.path = path, .first_line = number + 1, .lines = {}};
    while (next() && trimmed(line) != "-1") data.lines.push_back(line);
    if (kind != "58") continue;
    if (data.lines.size() < 11) data.refuse(0, "dataset 58 without data");
    if (data.integer(5, 0, 5) != frequency_response || data.integer(6, 10, 10) == 0) continue;
    if (data.lines.size() < 12) data.refuse(0, "dataset 58 without data");
    responses.push_back({.input = channel_of(data, "input:", 9),
                         .output = channel_of(data, "output:", 8),
                         .points = points_of(data),
                         .hold_rate_hz = hold_rate_of(data.lines[0]),
                         .left_out = 0});
    if (responses.back().input.name.empty()) responses.back().input.name = "applied";
    if (responses.back().output.name.empty()) responses.back().output.name = "output";
  }
  if (responses.empty())
    throw SweepFileError(path + ": holds no frequency response (dataset 58, function type 4)");
  return responses;
}

}  // namespace sinerig::record
