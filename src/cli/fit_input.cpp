#include "cli/fit_input.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <numbers>
#include <sstream>
#include <vector>

#include <spdlog/spdlog.h>

#include "identify/scatter.h"
#include "record/measured.h"

namespace sinerig::cli {

namespace {

constexpr double turn = 2.0 * std::numbers::pi;

bool is_sweep_file(const std::string& path) {
  std::ifstream file{path, std::ios::binary};
  if (!file) throw InputError(path + ": cannot be read; check the name");
  std::string magic(15, '\0');
  file.read(magic.data(), static_cast<std::streamsize>(magic.size()));
  return magic == "SQLite format 3";
}

FitInput from_run(const record::StoredRun& run, const std::string& path,
                  const std::string& channel) {
  const auto wanted = std::find_if(run.responses.begin(), run.responses.end(), [&](const auto& r) {
    return channel.empty() || run.channels.at(r.output).name == channel;
  });
  if (wanted == run.responses.end()) {
    std::string names;
    for (const auto& each : run.responses) names += " " + run.channels.at(each.output).name;
    throw InputError(path + ": has no response of \"" + channel + "\"; it has" + names);
  }
  FitInput input;
  input.rate_hz = run.plan.rate_hz;
  input.input = wanted->input;
  input.output = wanted->output;
  input.label = run.channels.at(wanted->input).name + " to " + run.channels.at(wanted->output).name;
  std::vector<double> degrees_of_freedom;
  for (const record::StoredPoint& point : wanted->points) {
    if (point.status != "good" && point.status != "imported") continue;
    const bool scatter = point.dof > 0.0;
    input.response.push_back(
        {turn * point.frequency_hz, point.response, scatter ? point.covariance.re_re : 0.0,
         scatter ? point.covariance.re_im : 0.0, scatter ? point.covariance.im_im : 0.0});
    degrees_of_freedom.push_back(point.dof);
  }
  const std::size_t left_out = wanted->points.size() - degrees_of_freedom.size();
  if (left_out > 0) spdlog::warn("{} points are not good and are left out", left_out);
  const bool pooled = std::all_of(degrees_of_freedom.begin(), degrees_of_freedom.end(),
                                  [](double dof) { return std::isfinite(dof); });
  if (pooled) input.response = identify::pooled_scatter(input.response, degrees_of_freedom);
  return input;
}

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> fields;
  std::istringstream stream{line};
  std::string field;
  while (std::getline(stream, field, ',')) {
    const auto first = field.find_first_not_of(" \t\r\"");
    const auto last = field.find_last_not_of(" \t\r\"");
    fields.push_back(first == std::string::npos ? "" : field.substr(first, last - first + 1));
  }
  return fields;
}

class CsvReader {
 public:
  explicit CsvReader(const std::string& path) : path_(path) {}

  FitInput read() {
    std::ifstream file{path_};
    std::string line;
    while (std::getline(file, line)) {
      ++line_number_;
      const auto fields = split(line);
      if (fields.empty() || fields[0].empty() || fields[0][0] == '#') continue;
      if (columns_.empty() && !is_number(fields[0]))
        name_columns(fields);
      else
        add_point(fields);
    }
    if (input_.response.empty())
      throw InputError(path_ + ": holds no points; wanted lines of freq_hz,re,im[,std]");
    check_units();
    input_.label = path_;
    return input_;
  }

 private:
  static bool is_number(const std::string& field) {
    char* end = nullptr;
    std::strtod(field.c_str(), &end);
    return !field.empty() && *end == '\0';
  }

  [[noreturn]] void refuse(const std::string& what) const {
    throw InputError(path_ + ":" + std::to_string(line_number_) + ": " + what);
  }

  void name_columns(const std::vector<std::string>& names) {
    for (std::size_t i = 0; i < names.size(); ++i) columns_[names[i]] = i;
    for (const char* needed : {"freq_hz", "re", "im"})
      if (!columns_.contains(needed))
        refuse(std::string{"the header has no column "} + needed +
               "; wanted freq_hz (Hz, not rad/s), re, im and optionally std");
  }

  double number(const std::vector<std::string>& fields, const std::string& name,
                double otherwise) const {
    const auto column = columns_.find(name);
    if (column == columns_.end() || column->second >= fields.size()) return otherwise;
    const std::string& field = fields[column->second];
    if (field.empty()) return otherwise;
    if (!is_number(field)) refuse(name + " is \"" + field + "\"; wanted a number");
    return std::strtod(field.c_str(), nullptr);
  }

  void add_point(const std::vector<std::string>& fields) {
    if (columns_.empty()) columns_ = {{"freq_hz", 0}, {"re", 1}, {"im", 2}, {"std", 3}};
    if (fields.size() < 3) refuse("fewer than three columns; wanted freq_hz,re,im[,std]");
    const auto status = columns_.find("status");
    if (status != columns_.end() && status->second < fields.size() &&
        fields[status->second] != "good" && fields[status->second] != "imported")
      return;
    const double nan = std::nan("");
    const double deviation = number(fields, "std", 0.0);
    if (deviation < 0.0) refuse("std is below zero");
    const double variance = deviation * deviation;
    input_.response.push_back({turn * number(fields, "freq_hz", nan),
                               {number(fields, "re", nan), number(fields, "im", nan)},
                               number(fields, "var_re", variance),
                               number(fields, "cov_re_im", 0.0),
                               number(fields, "var_im", variance)});
  }

  void check_units() const {
    const auto implausible = [](const identify::ResponsePoint& p) {
      return p.variance_re > std::norm(p.response);
    };
    const auto count = std::count_if(input_.response.begin(), input_.response.end(), implausible);
    if (2 * static_cast<std::size_t>(count) > input_.response.size())
      throw InputError(path_ + ": std exceeds |H| at " + std::to_string(count) + " of " +
                       std::to_string(input_.response.size()) +
                       " points; std is wanted in the unit of re and im, not in dB or per cent");
  }

  std::string path_;
  std::map<std::string, std::size_t> columns_;
  std::size_t line_number_ = 0;
  FitInput input_;
};

}  // namespace

FitInput read_fit_input(const std::string& path, const std::string& channel) {
  if (is_sweep_file(path)) {
    FitInput input = from_run(record::read_sweep(path), path, channel);
    input.sweep_file = true;
    return input;
  }
  for (const char* extension : {".mat", ".uff", ".unv"}) {
    if (path.ends_with(extension)) return from_run(record::read_measured(path), path, channel);
  }
  return CsvReader{path}.read();
}

}  // namespace sinerig::cli
