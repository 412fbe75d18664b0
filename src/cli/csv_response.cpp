#include "cli/csv_response.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <numbers>

#include "record/csv_text.h"

namespace sinerig::cli {

namespace {

using record::fields_of;
using record::is_number;

constexpr double turn = 2.0 * std::numbers::pi;
std::string text_of(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.10g", value);
  return text;
}

// The lines that are neither empty nor remarks, with their numbers.
class Lines {
 public:
  explicit Lines(const std::string& path) : path_(path), file_(path) {
    if (!file_) throw InputError(path + ": cannot be read; check the name");
  }

  bool next(std::string& line) {
    while (std::getline(file_, line)) {
      if (++number_ == 1) record::drop_byte_order_mark(line);
      if (line.find('\0') != std::string::npos) refuse("holds binary data; wanted text");
      const std::string content = record::trimmed_field(line);
      if (!content.empty() && content.front() != '#') return true;
    }
    return false;
  }

  [[noreturn]] void refuse(const std::string& what) const {
    throw InputError(path_ + ":" + std::to_string(number_) + ": " + what);
  }

 private:
  const std::string& path_;
  std::ifstream file_;
  std::size_t number_ = 0;
};

class Reader {
 public:
  explicit Reader(const std::string& path) : path_(path), lines_(path) {}

  CsvResponse read() {
    std::string line;
    while (lines_.next(line)) {
      if (record::has_decimal_commas(line))
        lines_.refuse("the numbers have decimal commas; write points, 0.5 instead of 0,5");
      fields_ = fields_of(line);
      if (columns_.empty() && !is_number(fields_.front())) {
        name_columns();
        continue;
      }
      if (columns_.empty()) columns_ = {{"freq_hz", 0}, {"re", 1}, {"im", 2}, {"std", 3}};
      add_point();
    }
    if (csv_.response.empty())
      throw InputError(path_ + ": holds no points; wanted lines of freq_hz,re,im[,std]");
    return csv_;
  }

 private:
  bool has(const std::string& name) const { return columns_.contains(name); }

  void name_columns() {
    for (std::size_t i = 0; i < fields_.size(); ++i) columns_.emplace(fields_[i], i);
    if (!has("freq_hz") && !has("omega_rad_s"))
      lines_.refuse(
          "the header has no column freq_hz (frequency in Hz) and none omega_rad_s (in rad/s); "
          "name it by its unit");
    const bool cartesian = has("re") && has("im");
    const bool polar = (has("gain_db") || has("gain")) && (has("phase_deg") || has("phase_rad"));
    if (!cartesian && !polar)
      lines_.refuse(std::string{"the header has no column "} + (has("re") ? "im" : "re") +
                    "; wanted re and im, or gain_db (or gain) and phase_deg (or phase_rad), and "
                    "optionally std");
  }

  std::string field(const std::string& name) const {
    const auto column = columns_.find(name);
    if (column == columns_.end() || column->second >= fields_.size()) return {};
    return fields_[column->second];
  }

  double number(const std::string& name) const {
    const std::string text = field(name);
    if (text.empty()) lines_.refuse("no value for " + name + "; fill it in or remove the line");
    if (!is_number(text)) lines_.refuse(name + " is \"" + text + "\"; wanted a number");
    const double value = std::strtod(text.c_str(), nullptr);
    if (!std::isfinite(value))
      lines_.refuse(name + " is " + text + ", not finite; remove the line");
    return value;
  }

  double number_or_zero(const std::string& name) const {
    return field(name).empty() ? 0.0 : number(name);
  }

  std::complex<double> measured() const {
    if (has("re") && has("im")) return {number("re"), number("im")};
    const double gain = has("gain_db") ? std::pow(10.0, number("gain_db") / 20.0) : number("gain");
    const double phase =
        has("phase_deg") ? number("phase_deg") * (turn / 360.0) : number("phase_rad");
    return {gain * std::cos(phase), gain * std::sin(phase)};
  }

  void check_order(double omega_rad_s) const {
    const std::string hz = text_of(omega_rad_s / turn) + " Hz";
    if (!(omega_rad_s > 0.0))
      lines_.refuse("the frequency is " + hz + ", but it must be above zero; remove the line");
    if (csv_.response.empty()) return;
    const double before = csv_.response.back().omega_rad_s;
    if (omega_rad_s == before)
      lines_.refuse(hz + ": the frequency occurs twice; merge the two points or remove one");
    if (omega_rad_s < before)
      lines_.refuse(hz + " comes after " + text_of(before / turn) +
                    " Hz: the frequencies must ascend; sort the lines");
  }

  void add_point() {
    if (fields_.size() < 3)
      lines_.refuse("fewer than three columns; wanted freq_hz,re,im[,std], by commas");
    const std::string status = field("status");
    if (!status.empty() && status != "good" && status != "imported") return;
    identify::ResponsePoint point;
    point.omega_rad_s = has("freq_hz") ? turn * number("freq_hz") : number("omega_rad_s");
    check_order(point.omega_rad_s);
    point.response = measured();
    if (has("hold_rate_hz") && csv_.response.empty())
      csv_.hold_rate_hz = std::max(number_or_zero("hold_rate_hz"), 0.0);
    if (has("std")) {
      const double deviation = number_or_zero("std");
      if (deviation < 0.0) lines_.refuse("std is below zero");
      point.variance_re = point.variance_im = deviation * deviation;
    } else {
      point.variance_re = number_or_zero("var_re");
      point.covariance = number_or_zero("cov_re_im");
      point.variance_im = number_or_zero("var_im");
    }
    csv_.response.push_back(point);
    if (!has("weight")) return;
    csv_.weights.push_back(number("weight"));
    if (!(csv_.weights.back() > 0.0)) lines_.refuse("the weight must be above zero");
  }

  std::string path_;
  Lines lines_;
  std::map<std::string, std::size_t> columns_;
  std::vector<std::string> fields_;
  CsvResponse csv_;
};

constexpr const char* trust = "; if it is right as it stands, say --trust-units";

void check_scatter_unit(const std::string& path, const identify::Response& response) {
  const auto count = std::count_if(response.begin(), response.end(), [](const auto& point) {
    return point.variance_re > std::norm(point.response);
  });
  if (2 * static_cast<std::size_t>(count) > response.size())
    throw InputError(path + ": std exceeds |H| at " + std::to_string(count) + " of " +
                     std::to_string(response.size()) +
                     " points; std is wanted in the unit of re and im, not in dB or per cent" +
                     trust);
}

// A Bode diagram in the columns of re and im: both fall with frequency, re by 20 and below zero, im
// by 60 and below −60, so that |H| would grow without bound, as that of no mechanism does.
void check_polar_unit(const std::string& path, const identify::Response& response) {
  const std::complex<double> first = response.front().response;
  const std::complex<double> last = response.back().response;
  int falls = 0;
  for (std::size_t i = 1; i < response.size(); ++i) {
    const std::complex<double> step = response[i].response - response[i - 1].response;
    falls += step.real() <= 0.0 && step.imag() <= 0.0 ? 1 : 0;
  }
  const bool mostly = 10 * falls >= 6 * static_cast<int>(response.size() - 1);
  if (response.size() < 4 || !mostly || first.real() - last.real() < 20.0 || last.real() > 0.0 ||
      first.imag() - last.imag() < 60.0 || last.imag() > -60.0)
    return;
  throw InputError(path +
                   ": re and im look like gain in dB and phase in degrees; name the columns "
                   "freq_hz,gain_db,phase_deg" +
                   trust);
}

}  // namespace

CsvResponse read_csv_response(const std::string& path, bool trust_units) {
  CsvResponse csv = Reader{path}.read();
  if (!trust_units) {
    check_scatter_unit(path, csv.response);
    check_polar_unit(path, csv.response);
  }
  return csv;
}

std::vector<double> read_number_column(const std::string& path) {
  Lines lines{path};
  std::vector<double> values;
  std::string line;
  bool first = true;
  while (lines.next(line)) {
    const std::vector<std::string> fields = fields_of(line);
    const bool header = first && !is_number(fields.front());
    first = false;
    if (header) continue;
    if (fields.size() != 1) lines.refuse("several columns; wanted one number per line");
    if (!is_number(fields.front())) lines.refuse("\"" + fields.front() + "\" is no number");
    values.push_back(std::strtod(fields.front().c_str(), nullptr));
  }
  return values;
}

}  // namespace sinerig::cli
