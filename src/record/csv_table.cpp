#include "record/csv_table.h"

#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>

#include "record/csv_text.h"
#include "record/database.h"
#include "record/utf8.h"

namespace sinerig::record {

namespace {

constexpr double turn = 2.0 * std::numbers::pi;

}  // namespace

CsvLines::CsvLines(const std::string& path) : path_{path}, stream_{path} {
  if (!stream_) throw SweepFileError(path + ": cannot be read; check the name");
}

bool CsvLines::next(std::string& line) {
  while (std::getline(stream_, line)) {
    if (++number_ == 1) drop_byte_order_mark(line);
    if (line.find('\0') != std::string::npos) refuse("holds binary data; wanted text");
    line = as_utf8(line);
    // A spreadsheet puts a remark that holds a separator into quotes.
    const std::string content = trimmed_field(line);
    if (content.empty()) continue;
    if (content.front() != '#') return true;
    remarks_.push_back(trimmed_field(content.substr(1)));
  }
  return false;
}

void CsvLines::refuse(const std::string& what) const {
  throw SweepFileError(path_ + ":" + std::to_string(number_) + ": " + what);
}

CsvTable::CsvTable(const std::string& path) : lines_{path} {}

bool CsvTable::next() {
  std::string line;
  while (lines_.next(line)) {
    if (has_decimal_commas(line))
      lines_.refuse("the numbers have decimal commas; write points, 0.5 instead of 0,5");
    fields_ = fields_of(line);
    if (!columns_.empty()) return true;
    const bool headed = !is_number(fields_.front());
    name_columns(headed ? fields_ : std::vector<std::string>{"freq_hz", "re", "im", "std"}, headed);
    if (!headed) return true;
  }
  return false;
}

void CsvTable::name_columns(const std::vector<std::string>& names, bool headed) {
  if (!headed && fields_.size() < 3)
    lines_.refuse("fewer than three columns; wanted freq_hz,re,im[,std], by commas");
  for (std::size_t i = 0; i < names.size(); ++i) columns_.emplace(names[i], i);
  if (!has("freq_hz") && !has("omega_rad_s"))
    lines_.refuse(
        "the header has no column freq_hz (frequency in Hz) and none omega_rad_s (in rad/s); "
        "name it by its unit");
  for (const std::string& name : needed_columns()) {
    if (!has(name))
      lines_.refuse("the header has no column " + name +
                    "; wanted re and im, or gain_db (or gain) and phase_deg (or phase_rad), and "
                    "optionally std");
  }
}

std::string CsvTable::text(const std::string& column) const {
  const auto found = columns_.find(column);
  if (found == columns_.end() || found->second >= fields_.size()) return {};
  return fields_[found->second];
}

double CsvTable::number(const std::string& column) const {
  const std::string value = text(column);
  if (value.empty()) return std::numeric_limits<double>::quiet_NaN();
  if (!is_number(value)) lines_.refuse(column + " is \"" + value + "\"; wanted a number");
  return std::strtod(value.c_str(), nullptr);
}

void CsvTable::refuse_empty() const {
  throw SweepFileError(lines_.path() + ": holds no points; wanted lines of freq_hz,re,im[,std]");
}

double CsvTable::frequency_hz() const {
  return has("freq_hz") ? number("freq_hz") : number("omega_rad_s") / turn;
}

double CsvTable::omega_rad_s() const {
  return has("freq_hz") ? turn * number("freq_hz") : number("omega_rad_s");
}

std::complex<double> CsvTable::response() const {
  if (has("re") && has("im")) return {number("re"), number("im")};
  const double gain = has("gain_db") ? std::pow(10.0, number("gain_db") / 20.0) : number("gain");
  const double phase =
      has("phase_deg") ? number("phase_deg") * (turn / 360.0) : number("phase_rad");
  return {gain * std::cos(phase), gain * std::sin(phase)};
}

std::string CsvTable::either(const char* first, const char* second) const {
  return !has(first) && has(second) ? second : first;
}

std::vector<std::string> CsvTable::needed_columns() const {
  const bool cartesian = has("re") && has("im");
  const std::string gain = either("gain_db", "gain");
  const bool polar = !cartesian && (has(gain) || has("phase_deg") || has("phase_rad"));
  const std::string frequency = either("freq_hz", "omega_rad_s");
  if (polar) return {frequency, gain, either("phase_deg", "phase_rad")};
  return {frequency, "re", "im"};
}

}  // namespace sinerig::record
