#include <filesystem>
#include <fstream>
#include <iterator>

#include <spdlog/spdlog.h>

#include "cli/commands.h"
#include "cli/recorded_run.h"

namespace sinerig::cli {

namespace {

namespace fs = std::filesystem;

// Where the rig file was: what it leads to (a DBC, a profile) is found from there.
std::string rig_path(const record::StoredRun& run) {
  const std::string path = run.fact("rig_path");
  return path.empty() ? run.fact("rig_name") : path;
}

// The run goes on as it began. Whoever has edited the rig file since should know that it does.
void tell_of_edits(const std::string& path, const std::string& text) {
  std::ifstream stream{path, std::ios::binary};
  if (!stream) return;
  const std::string now{std::istreambuf_iterator<char>{stream}, {}};
  if (now != text) {
    spdlog::warn("{} has changed since the run began; the run goes on with the rig file as it was",
                 path);
  }
}

}  // namespace

int resume_command(const ResumeOptions& options, const std::vector<DriverKit>& drivers) {
  if (!fs::exists(options.file)) {
    throw record::SweepFileError(options.file + ": does not exist");
  }
  {
    // Whose run still goes on is not to be judged by what it has written so far.
    const record::FileLock nobody_writes{options.file, record::file_in_use};
  }
  record::UnfinishedRun earlier = record::read_unfinished(options.file);
  if (earlier.done()) {
    spdlog::info("{}: its run is done, there is nothing to resume", options.file);
    return exit_done;
  }
  const std::string rig = rig_path(earlier.stored);
  const std::string text = earlier.stored.fact("rig_text");
  tell_of_edits(rig, text);
  ConfiguredRig configured{config::RigFile::parse(text, rig), drivers};
  const SweepPlan plan = configured.rig().plan();
  earlier.finished.refined = record::candidates_refined(options.file, earlier.stored.plan, plan);
  const std::size_t dwells = earlier.stored.plan.dwells.size();
  spdlog::info("{}: {} of {} dwells are finished, {} to go", options.file, earlier.finished.dwells,
               dwells, dwells - earlier.finished.dwells);
  return record_run(
      configured, plan,
      {.sweep_file = options.file,
       .voice = options.voice,
       .report = options.report,
       .table = options.table,
       .serve = options.serve,
       .service = options.service},
      [&] {
        return std::make_unique<record::SweepWriter>(options.file,
                                                     run_info(configured.rig(), plan));
      },
      &earlier);
}

}  // namespace sinerig::cli
