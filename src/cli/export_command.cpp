#include <algorithm>
#include <filesystem>
#include <iostream>
#include <sstream>

#include <spdlog/spdlog.h>

#include "cli/chosen_response.h"
#include "cli/commands.h"
#include "cli/measured_run.h"
#include "cli/output_file.h"
#include "record/exporters.h"
#include "record/mat_file.h"
#include "record/snippet.h"
#include "record/uff58.h"

namespace sinerig::cli {

namespace {

namespace fs = std::filesystem;
using record::StoredResponse;
using record::StoredRun;

// All responses, or the one that was asked for.
std::vector<const StoredResponse*> chosen_responses(const StoredRun& run,
                                                    const ExportOptions& options) {
  if (!options.channel.empty() || run.responses.empty())
    return {&chosen_response(run, options.file, options.channel)};
  std::vector<const StoredResponse*> all;
  for (const StoredResponse& response : run.responses) all.push_back(&response);
  return all;
}

// UFF has no place for a status: whoever reads the file would take every point for good.
void warn_of_lost_status(const std::vector<const StoredResponse*>& responses) {
  std::ptrdiff_t bad = 0;
  for (const StoredResponse* response : responses) {
    bad += std::count_if(response->points.begin(), response->points.end(), [](const auto& point) {
      return point.status != "good" && point.status != "imported";
    });
  }
  if (bad > 0) {
    spdlog::warn("{} points are not good; UFF has no place to say so, and none for intervals", bad);
  }
}

void leave_out_empty(std::vector<const StoredResponse*>& responses, const StoredRun& run,
                     const std::string& file) {
  std::erase_if(responses, [&](const StoredResponse* response) {
    if (record::fits_uff58(*response)) return false;
    spdlog::warn("{} has no point with a response; left out",
                 run.channels.at(response->output).name);
    return true;
  });
  if (responses.empty())
    throw record::SweepFileError(file + ": has no point with a response, nothing to write");
}

void write_snippet(std::ostream& stream, const StoredRun& run, const ExportOptions& options) {
  const StoredResponse& response = chosen_response(run, options.file, options.channel);
  const std::string source = fs::path{options.file}.filename().string();
  if (fs::path{options.output}.extension() == ".m") {
    record::write_matlab_snippet(stream, run, response, source);
  } else {
    record::write_python_snippet(stream, run, response, source);
  }
}

void export_to(std::ostream& stream, const StoredRun& run, const ExportOptions& options) {
  if (options.format == "json") {
    record::write_json(stream, run);
  } else if (options.format == "uff") {
    auto responses = chosen_responses(run, options);
    leave_out_empty(responses, run, options.file);
    warn_of_lost_status(responses);
    record::write_uff58(stream, run, responses, fs::path{options.file}.stem().string());
  } else if (options.format == "snippet") {
    write_snippet(stream, run, options);
  } else {
    record::write_csv(stream, run, chosen_response(run, options.file, options.channel));
  }
}

void export_mat(const StoredRun& run, const ExportOptions& options) {
  if (options.output.empty()) {
    throw record::FileExists("--format mat writes a binary file: say which with -o NAME.mat");
  }
  refuse_existing(options.output, options.force);
  record::write_mat(options.output, run, chosen_responses(run, options));
}

}  // namespace

int export_command(const ExportOptions& options) {
  refuse_input(options.output, {options.file});
  const StoredRun run = read_run(options.file);
  if (options.format == "mat") {
    export_mat(run, options);
  } else if (options.output.empty()) {
    export_to(std::cout, run, options);
  } else {
    std::ostringstream text;
    export_to(text, run, options);
    write_file(options.output, options.force, [&](std::ostream& stream) { stream << text.str(); });
  }
  return exit_done;
}

}  // namespace sinerig::cli
