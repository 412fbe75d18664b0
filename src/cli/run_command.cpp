#include <filesystem>

#include "cli/commands.h"
#include "cli/recorded_run.h"

namespace sinerig::cli {

namespace {

namespace fs = std::filesystem;

// rig.sweep in the working directory, or rig-2.sweep … when that exists.
std::string default_output(const std::string& rig, bool force) {
  const std::string stem = fs::path{rig}.stem().string();
  std::string name = stem + ".sweep";
  for (int number = 2; !force && fs::exists(name); ++number) {
    name = stem + "-" + std::to_string(number) + ".sweep";
  }
  return name;
}

}  // namespace

int run_command(const RunOptions& options, const std::vector<DriverKit>& drivers) {
  ConfiguredRig configured{config::RigFile::load(options.rig), drivers};
  const SweepPlan plan = configured.rig().plan();
  const std::string path =
      options.output.empty() ? default_output(options.rig, options.force) : options.output;
  const auto if_exists = options.force ? record::SweepWriter::IfExists::replace
                                       : record::SweepWriter::IfExists::refuse;
  return record_run(configured, plan,
                    {.sweep_file = path,
                     .voice = options.voice,
                     .report = options.report,
                     .serve = options.serve},
                    [&] {
                      return std::make_unique<record::SweepWriter>(
                          path, run_info(configured.rig(), plan), if_exists);
                    });
}

}  // namespace sinerig::cli
