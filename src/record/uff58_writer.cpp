#include <algorithm>
#include <cmath>
#include <ostream>

#include "record/point_columns.h"
#include "record/text.h"
#include "record/uff58.h"
#include "record/utf8.h"

namespace sinerig::record {

namespace {

constexpr std::size_t abscissa_columns = 13;
constexpr std::size_t line_columns = 80;

// At least ten digits from 1 mHz on, nine below. FORTRAN takes a number with a decimal point as it
// stands, whatever the digits of the E13.5 that reads it. In front of the first number of a line no
// blank is needed.
std::string abscissa(double value) {
  if (value >= 1e-3 && value < 0.1) return text("%.12f", value).substr(1);
  const bool plain = value >= 0.1 && value < 1e10;
  for (int digits = 12; digits > 5; --digits) {
    const int before = plain ? std::max(1, static_cast<int>(std::floor(std::log10(value))) + 1) : 1;
    std::string number =
        plain ? text("%.*f", std::max(1, digits - before), value) : text("%.*E", digits - 1, value);
    if (const std::size_t zero = number.find("E-0"); zero != std::string::npos)
      number.erase(zero + 2, 1);
    if (number.size() < abscissa_columns || (!plain && number.size() == abscissa_columns))
      return std::string(abscissa_columns - number.size(), ' ') + number;
  }
  return text("%13.5E", value);
}

// A line of at most 80 columns; an empty one is NONE.
std::string id_line(const std::string& line) {
  return (line.empty() ? "NONE" : shortened(line, line_columns)) + "\n";
}

// The unit stands behind the name, where a line that is cut off would lose it: the name gives way.
std::string channel_line(const std::string& key, const ChannelInfo& channel) {
  const std::string unit = " [" + shortened(channel.unit, line_columns / 2) + "]";
  return id_line(key + shortened(channel.name, line_columns - key.size() - unit.size()) + unit);
}

// Specific data type of the format for a unit: displacement 8, velocity 11, acceleration 12,
// excitation force 13, general 1.
int data_type(const std::string& unit) {
  if (unit == "m" || unit == "mm" || unit == "rad" || unit == "deg") return 8;
  if (unit == "m/s" || unit == "mm/s" || unit == "rad/s" || unit == "deg/s") return 11;
  if (unit == "m/s²" || unit == "m/s^2" || unit == "rad/s²" || unit == "rad/s^2") return 12;
  if (unit == "N" || unit == "Nm") return 13;
  return 1;
}

std::string axis_line(int type, const std::string& label, const std::string& unit) {
  return text("%10d%5d%5d%5d %-20s %-20s\n", type, 0, 0, 0,
              label.empty() ? "NONE" : shortened(label, 20).c_str(),
              unit.empty() ? "NONE" : shortened(unit, 20).c_str());
}

bool has_response(const StoredPoint& point) {
  return std::isfinite(std::abs(point.response));
}

void write_dataset(std::ostream& stream, const StoredRun& run, const StoredResponse& response,
                   const std::string& run_name) {
  const ChannelInfo& input = run.channels.at(response.input);
  const ChannelInfo& output = run.channels.at(response.output);
  std::vector<const StoredPoint*> points;
  for (const StoredPoint& point : response.points)
    if (has_response(point)) points.push_back(&point);
  if (points.empty()) return;

  const std::string hold =
      response.hold_rate_hz > 0.0 ? text("hold_rate_hz=%.15g ", response.hold_rate_hz) : "";
  stream << "    -1\n    58\n"
         << id_line("sinerig " + hold + run_name) << id_line(response_convention)
         << id_line(run.fact("started_utc")) << channel_line("output: ", output)
         << channel_line("input: ", input)
         << text("%5d%10d%5d%10d %-10s%10d%4d %-10s%10d%4d\n", 4, 0, 0, 0,
                 shortened(output.name, 10).c_str(), static_cast<int>(response.output), 0,
                 shortened(input.name, 10).c_str(), static_cast<int>(response.input), 0)
         << text("%10d%10zu%10d%13.5E%13.5E%13.5E\n", 6, points.size(), 0,
                 points.front()->frequency_hz, 0.0, 0.0)
         << axis_line(18, "Frequency", "Hz")
         << axis_line(data_type(output.unit), output.name, output.unit)
         << axis_line(data_type(input.unit), input.name, input.unit) << axis_line(0, "", "");
  for (const StoredPoint* point : points) {
    stream << abscissa(point->frequency_hz)
           << text("%20.12E%20.12E\n", point->response.real(), point->response.imag());
  }
  stream << "    -1\n";
}

}  // namespace

bool fits_uff58(const StoredResponse& response) {
  return std::any_of(response.points.begin(), response.points.end(), has_response);
}

void write_uff58(std::ostream& stream, const StoredRun& run,
                 const std::vector<const StoredResponse*>& responses, const std::string& run_name) {
  for (const StoredResponse* response : responses) write_dataset(stream, run, *response, run_name);
}

}  // namespace sinerig::record
