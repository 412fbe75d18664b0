#include "record/csv_reader.h"

#include <cmath>
#include <limits>

#include "record/csv_table.h"
#include "record/point_columns.h"

namespace sinerig::record {

namespace {

// "# output: encoder [rad]" → {encoder, rad}.
void read_channel(const std::string& remark, const std::string& key, ChannelInfo& channel) {
  if (remark.rfind(key, 0) == 0) channel = channel_from_text(remark.substr(key.size()));
}

StoredPoint point_of(const CsvTable& row) {
  StoredPoint point = imported_point();
  point.frequency_hz = row.frequency_hz();
  point.response = row.response();
  if (!row.text("std").empty()) {
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

double hold_rate_of(const CsvTable& row) {
  const double rate_hz = row.number("hold_rate_hz");
  return rate_hz > 0.0 && std::isfinite(rate_hz) ? rate_hz : 0.0;
}

}  // namespace

ImportedResponse read_csv(const std::string& path) {
  CsvTable table{path};
  ImportedResponse response;
  response.input = {"applied", ""};
  response.output = {"output", ""};
  while (table.next()) {
    if (response.points.empty()) {
      if (table.has("hold_rate_hz")) response.hold_rate_hz = hold_rate_of(table);
      if (table.has("input")) response.input = {table.text("input"), table.text("input_unit")};
      if (table.has("output")) response.output = {table.text("output"), table.text("output_unit")};
    }
    response.points.push_back(point_of(table));
  }
  for (const std::string& remark : table.lines().remarks()) {
    if (!table.has("input")) read_channel(remark, "input:", response.input);
    if (!table.has("output")) read_channel(remark, "output:", response.output);
  }
  if (response.points.empty()) table.refuse_empty();
  return response;
}

}  // namespace sinerig::record
