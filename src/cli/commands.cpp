#include "cli/commands.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>

#include <spdlog/spdlog.h>

#include "cli/configured_rig.h"
#include "record/exporters.h"
#include "record/sweep_reader.h"
#include "report/terminal.h"

namespace sinerig::cli {

namespace {

// The response of the named channel, the first sensor where none is named.
const record::StoredResponse& chosen_response(const record::StoredRun& run,
                                              const ExportOptions& options) {
  if (run.responses.empty()) {
    throw record::SweepFileError(options.file + ": holds no finished point yet");
  }
  if (options.channel.empty()) {
    if (run.responses.size() > 1) {
      spdlog::info("exporting {} only; --channel chooses another, --format json holds all {}",
                   run.channels.at(run.responses.front().output).name, run.responses.size());
    }
    return run.responses.front();
  }
  const auto found = std::find_if(
      run.responses.begin(), run.responses.end(),
      [&](const auto& each) { return run.channels.at(each.output).name == options.channel; });
  if (found != run.responses.end()) return *found;
  std::string names;
  for (const auto& each : run.responses) names += " " + run.channels.at(each.output).name;
  throw record::SweepFileError(options.file + ": has no response of \"" + options.channel +
                               "\"; it has" + names);
}

void export_to(std::ostream& stream, const record::StoredRun& run, const ExportOptions& options) {
  if (options.format == "json") {
    write_json(stream, run);
  } else {
    write_csv(stream, run, chosen_response(run, options));
  }
}

}  // namespace

int plan_command(const std::string& rig_path, const std::vector<DriverKit>& drivers) {
  const ConfiguredRig configured{rig_path, drivers};
  const config::Rig& rig = configured.rig();
  report::print_plan(std::cout, rig.plan(), rig.sweep, rig.actuator.unit);
  return exit_done;
}

int show_command(const std::string& file) {
  report::print_run(std::cout, record::read_sweep(file));
  return exit_done;
}

int export_command(const ExportOptions& options) {
  const record::StoredRun run = record::read_sweep(options.file);
  if (options.output.empty()) {
    export_to(std::cout, run, options);
    return exit_done;
  }
  if (!options.force && std::filesystem::exists(options.output)) {
    throw record::FileExists(
        options.output + ": exists already; choose another name with -o, or --force to replace it");
  }
  std::ofstream stream{options.output, std::ios::binary};
  export_to(stream, run, options);
  stream.close();
  if (!stream) throw record::SweepFileError(options.output + ": cannot be written");
  return exit_done;
}

int drivers_command(const std::vector<DriverKit>& drivers) {
  for (const DriverKit& driver : drivers)
    std::cout << driver.name << "  " << driver.summary << '\n';
  return exit_done;
}

}  // namespace sinerig::cli
