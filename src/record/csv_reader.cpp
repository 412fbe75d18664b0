#include "record/csv_reader.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <map>
#include <numbers>

#include "record/csv_text.h"
#include "record/point_columns.h"
#include "record/utf8.h"

namespace sinerig::record {

namespace {

constexpr double radians_per_degree = std::numbers::pi / 180.0;

// "# output: encoder [rad]" → {encoder, rad}.
bool read_channel(const std::string& remark, const std::string& key, ChannelInfo& channel) {
  if (remark.rfind(key, 0) != 0) return false;
  channel = channel_from_text(remark.substr(key.size()));
  return true;
}

// One line of values under the names of their columns.
class Row {
 public:
  Row(const std::map<std::string, std::size_t>& columns, std::vector<std::string> fields,
      std::string place)
      : columns_{columns}, fields_{std::move(fields)}, place_{std::move(place)} {}

  std::string text(const std::string& name) const {
    const auto found = columns_.find(name);
    if (found == columns_.end() || found->second >= fields_.size()) return {};
    return fields_[found->second];
  }

  bool has(const std::string& name) const { return columns_.contains(name); }

  double number(const std::string& name) const {
    const std::string value = text(name);
    if (value.empty()) return std::numeric_limits<double>::quiet_NaN();
    if (!is_number(value))
      throw SweepFileError(place_ + ": " + name + " = \"" + value + "\" is not a number");
    return std::strtod(value.c_str(), nullptr);
  }

 private:
  const std::map<std::string, std::size_t>& columns_;
  std::vector<std::string> fields_;
  std::string place_;
};

std::complex<double> response_of(const Row& row) {
  if (row.has("re")) return {row.number("re"), row.number("im")};
  const double gain =
      row.has("gain_db") ? std::pow(10.0, row.number("gain_db") / 20.0) : row.number("gain");
  const double phase =
      row.has("phase_deg") ? row.number("phase_deg") * radians_per_degree : row.number("phase_rad");
  return {gain * std::cos(phase), gain * std::sin(phase)};
}

StoredPoint point_of(const Row& row) {
  StoredPoint point = imported_point();
  point.frequency_hz = row.has("freq_hz") ? row.number("freq_hz")
                                          : row.number("omega_rad_s") / (2.0 * std::numbers::pi);
  point.response = response_of(row);
  if (row.has("std")) {
    const double variance = row.number("std") * row.number("std");
    point.covariance = {variance, 0.0, variance};
  } else {
    point.covariance = {row.number("var_re"), row.number("cov_re_im"), row.number("var_im")};
  }
  for (const PointColumn& column : point_columns) point.*column.value = row.number(column.name);
  if (std::isnan(point.dof)) {
    const bool known = !row.has("dof") && std::isfinite(point.covariance.re_re);
    point.dof = known ? std::numeric_limits<double>::infinity() : 0.0;
  }
  if (!row.text("status").empty()) point.status = row.text("status");
  point.reason = row.text("reason");
  point.settled_by = row.text("settled_by");
  return point;
}

double hold_rate_of(const Row& row) {
  const double rate_hz = row.number("hold_rate_hz");
  return rate_hz > 0.0 && std::isfinite(rate_hz) ? rate_hz : 0.0;
}

void check_columns(const std::map<std::string, std::size_t>& columns, const std::string& place) {
  const auto has = [&](const char* name) {
    return columns.contains(name);
  };
  if (!has("freq_hz") && !has("omega_rad_s"))
    throw SweepFileError(place + ": no column freq_hz or omega_rad_s");
  const bool cartesian = has("re") && has("im");
  const bool polar = (has("gain_db") || has("gain")) && (has("phase_deg") || has("phase_rad"));
  if (!cartesian && !polar) {
    throw SweepFileError(place +
                         ": no columns for the response: re and im, or gain_db (or gain) and "
                         "phase_deg (or phase_rad)");
  }
}

}  // namespace

ImportedResponse read_csv(const std::string& path) {
  std::ifstream stream{path};
  if (!stream) throw SweepFileError(path + ": cannot be read");
  ImportedResponse response;
  response.input = {"applied", ""};
  response.output = {"output", ""};
  std::map<std::string, std::size_t> columns;
  std::string line;
  for (int number = 1; std::getline(stream, line); ++number) {
    const std::string place = path + ":" + std::to_string(number);
    if (number == 1) drop_byte_order_mark(line);
    if (line.find('\0') != std::string::npos)
      throw SweepFileError(place + ": holds binary data; wanted text");
    // The quotes of a line are those of its fields.
    const std::size_t content = line.find_first_not_of(" \t\r\f\v");
    line = content == std::string::npos ? std::string{} : as_utf8(line.substr(content));
    if (line.empty()) continue;
    if (line.front() == '#') {
      const std::string remark = trimmed_field(line.substr(1));
      if (!read_channel(remark, "input:", response.input))
        read_channel(remark, "output:", response.output);
      continue;
    }
    std::vector<std::string> fields = fields_of(line);
    if (columns.empty()) {
      const bool headed = !is_number(fields.front());
      const std::vector<std::string> names =
          headed ? fields : std::vector<std::string>{"freq_hz", "re", "im", "std"};
      for (std::size_t i = 0; i < std::min(names.size(), fields.size()); ++i)
        columns.emplace(names[i], i);
      check_columns(columns, place);
      if (headed) continue;
    }
    const Row row{columns, std::move(fields), place};
    if (response.points.empty()) {
      if (row.has("hold_rate_hz")) response.hold_rate_hz = hold_rate_of(row);
      if (row.has("input")) response.input = {row.text("input"), row.text("input_unit")};
      if (row.has("output")) response.output = {row.text("output"), row.text("output_unit")};
    }
    response.points.push_back(point_of(row));
  }
  if (response.points.empty()) throw SweepFileError(path + ": holds no point");
  return response;
}

}  // namespace sinerig::record
