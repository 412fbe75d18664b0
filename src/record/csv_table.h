// A response in comma separated values, line by line: what every reader of such files has in
// common.
#pragma once

#include <complex>
#include <cstddef>
#include <fstream>
#include <map>
#include <string>
#include <vector>

namespace sinerig::record {

// The lines of a text file that are neither empty nor remarks.
class CsvLines {
 public:
  // Throws SweepFileError where the file cannot be read.
  explicit CsvLines(const std::string& path);

  // Goes to the next line; false behind the last. Throws SweepFileError for binary data.
  bool next(std::string& line);

  // What stands behind the # of the lines passed so far.
  const std::vector<std::string>& remarks() const { return remarks_; }

  const std::string& path() const { return path_; }

  // Throws SweepFileError: file, line and what is wrong.
  [[noreturn]] void refuse(const std::string& what) const;

 private:
  std::string path_;
  std::ifstream stream_;
  std::size_t number_ = 0;
  std::vector<std::string> remarks_;
};

// The points of a response. A line of names in front says what the columns are: freq_hz or
// omega_rad_s; re and im, or gain_db (or gain) with phase_deg (or phase_rad); others as their
// reader knows them. Without it they are freq_hz, re, im[, std]. Comma, semicolon or tab.
class CsvTable {
 public:
  // Throws SweepFileError where the file cannot be read.
  explicit CsvTable(const std::string& path);

  // Goes to the next point; false behind the last. Throws SweepFileError where a column is missing
  // and for decimal commas.
  bool next();

  bool has(const std::string& column) const { return columns_.contains(column); }

  // Empty where the line has no such field.
  std::string text(const std::string& column) const;

  // NaN where there is no value. Throws SweepFileError for what is no number.
  double number(const std::string& column) const;

  // Of this line, in Hz and rad/s; NaN where there is no value.
  double frequency_hz() const;
  double omega_rad_s() const;
  std::complex<double> response() const;

  // The columns that the frequency and the response are from.
  std::vector<std::string> needed_columns() const;

  const CsvLines& lines() const { return lines_; }

  // Throws SweepFileError for a file without a point.
  [[noreturn]] void refuse_empty() const;

 private:
  void name_columns(const std::vector<std::string>& names, bool headed);
  // The first of two that the file has.
  std::string either(const char* first, const char* second) const;

  CsvLines lines_;
  std::map<std::string, std::size_t> columns_;
  std::vector<std::string> fields_;
};

}  // namespace sinerig::record
