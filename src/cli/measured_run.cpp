#include "cli/measured_run.h"

#include <algorithm>
#include <filesystem>

#include <spdlog/spdlog.h>

#include "record/measured.h"

namespace sinerig::cli {

void refuse_folder(const std::string& path) {
  std::error_code unknown;
  if (std::filesystem::is_directory(path, unknown))
    throw record::SweepFileError(path + ": is a folder; wanted a file");
}

record::StoredRun read_run(const std::string& path) {
  refuse_folder(path);
  record::StoredRun run = record::read_measured(path);
  const std::string left_out = run.fact(record::left_out_fact);
  if (!left_out.empty())
    spdlog::warn("{}: points left out whose frequency is not above zero: {}", path, left_out);
  return run;
}

bool is_named(const record::StoredRun& run, const record::StoredResponse& response,
              const std::string& channel) {
  const std::string& output = run.channels.at(response.output).name;
  return channel == output || channel == output + "/" + run.channels.at(response.input).name;
}

std::string names_of_responses(const record::StoredRun& run) {
  std::string names;
  for (const record::StoredResponse& each : run.responses) {
    const std::string& output = run.channels.at(each.output).name;
    const auto same = std::count_if(
        run.responses.begin(), run.responses.end(),
        [&](const record::StoredResponse& other) { return other.output == each.output; });
    names += " " + output;
    if (same > 1) names += "/" + run.channels.at(each.input).name;
  }
  return names;
}

}  // namespace sinerig::cli
