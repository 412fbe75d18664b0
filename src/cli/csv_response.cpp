#include "cli/csv_response.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>

#include "record/csv_table.h"
#include "record/csv_text.h"
#include "record/database.h"

namespace sinerig::cli {

namespace {

using record::SweepFileError;

constexpr double turn = 2.0 * std::numbers::pi;

std::string text_of(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.10g", value);
  return text;
}

// The points of a table that a fit can take.
class Reader {
 public:
  explicit Reader(const std::string& path) : table_{path} {}

  CsvResponse read() {
    while (table_.next()) {
      const std::string status = table_.text("status");
      if (status.empty() || status == "good" || status == "imported") add_point();
    }
    if (csv_.response.empty()) table_.refuse_empty();
    return csv_;
  }

 private:
  [[noreturn]] void refuse(const std::string& what) const { table_.lines().refuse(what); }

  double finite(const std::string& name) const {
    const double value = table_.number(name);
    if (table_.text(name).empty())
      refuse("no value for " + name + "; fill it in or remove the line");
    if (!std::isfinite(value))
      refuse(name + " is " + table_.text(name) + ", not finite; remove the line");
    return value;
  }

  double finite_or_zero(const std::string& name) const {
    return table_.text(name).empty() ? 0.0 : finite(name);
  }

  void check_order(double omega_rad_s) const {
    const std::string hz = text_of(omega_rad_s / turn) + " Hz";
    if (!(omega_rad_s > 0.0))
      refuse("the frequency is " + hz + ", but it must be above zero; remove the line");
    if (csv_.response.empty()) return;
    const double before = csv_.response.back().omega_rad_s;
    if (omega_rad_s == before)
      refuse(hz + ": the frequency occurs twice; merge the two points or remove one");
    if (omega_rad_s < before)
      refuse(hz + " comes after " + text_of(before / turn) +
             " Hz: the frequencies must ascend; sort the lines");
  }

  void add_point() {
    for (const std::string& name : table_.needed_columns()) finite(name);
    identify::ResponsePoint point;
    point.omega_rad_s = table_.omega_rad_s();
    check_order(point.omega_rad_s);
    point.response = table_.response();
    if (csv_.response.empty()) csv_.hold_rate_hz = std::max(finite_or_zero("hold_rate_hz"), 0.0);
    if (table_.has("std")) {
      const double deviation = finite_or_zero("std");
      if (deviation < 0.0) refuse("std is below zero");
      point.variance_re = point.variance_im = deviation * deviation;
    } else {
      point.variance_re = finite_or_zero("var_re");
      point.covariance = finite_or_zero("cov_re_im");
      point.variance_im = finite_or_zero("var_im");
    }
    csv_.response.push_back(point);
    if (!table_.has("weight")) return;
    csv_.weights.push_back(finite("weight"));
    if (!(csv_.weights.back() > 0.0)) refuse("the weight must be above zero");
  }

  record::CsvTable table_;
  CsvResponse csv_;
};

constexpr const char* trust = "; if it is right as it stands, say --trust-units";

void check_scatter_unit(const std::string& path, const identify::Response& response) {
  const auto count = std::count_if(response.begin(), response.end(), [](const auto& point) {
    return point.variance_re > std::norm(point.response);
  });
  if (2 * static_cast<std::size_t>(count) > response.size())
    throw SweepFileError(path + ": std exceeds |H| at " + std::to_string(count) + " of " +
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
  throw SweepFileError(path +
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
  record::CsvLines lines{path};
  std::vector<double> values;
  std::string line;
  bool first = true;
  while (lines.next(line)) {
    const std::vector<std::string> fields = record::fields_of(line);
    const bool header = first && !record::is_number(fields.front());
    first = false;
    if (header) continue;
    if (fields.size() != 1) lines.refuse("several columns; wanted one number per line");
    if (!record::is_number(fields.front())) lines.refuse("\"" + fields.front() + "\" is no number");
    values.push_back(std::strtod(fields.front().c_str(), nullptr));
  }
  return values;
}

}  // namespace sinerig::cli
