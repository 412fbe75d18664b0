#include <cctype>
#include <charconv>
#include <filesystem>
#include <stdexcept>

#include <spdlog/spdlog.h>

#include "cli/commands.h"
#include "cli/included_files.h"
#include "cli/recorded_run.h"
#include "record/file_lock.h"

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

// 1 of rig.sweep, 4 of rig-4.sweep; 0 of what default_output() never calls a sweep of `stem`.
int output_number(const fs::path& path, const std::string& stem) {
  const std::string name = path.stem().string();
  if (path.extension() != ".sweep" || !name.starts_with(stem)) return 0;
  if (name == stem) return 1;
  const char* const end = name.data() + name.size();
  int number = 0;
  const auto read = std::from_chars(name.data() + stem.size() + 1, end, number);
  return name[stem.size()] == '-' && read.ptr == end && number >= 2 ? number : 0;
}

// The last sweep of the rig in the working directory; empty where there is none.
std::string last_output(const std::string& rig) {
  const std::string stem = fs::path{rig}.stem().string();
  std::string last;
  int highest = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator{"."}) {
    const int number = output_number(entry.path(), stem);
    if (number <= highest) continue;
    highest = number;
    last = entry.path().filename().string();
  }
  return last;
}

// Whether the sweep ended early, of the rig file as it is now.
bool goes_on(const std::string& sweep_file, const config::Rig& rig, const SweepPlan& plan) {
  if (sweep_file.empty() || !fs::exists(sweep_file)) return false;
  try {
    { const record::FileLock nobody_writes{sweep_file, record::file_in_use}; }
    if (!record::is_begun(sweep_file)) return false;
    const record::UnfinishedRun earlier = record::read_unfinished(sweep_file);
    if (earlier.done()) return false;
    if (earlier.stored.fact("rig_text") != rig.file->text()) {
      spdlog::info("{} is not finished, but {} has changed since: a new sweep begins", sweep_file,
                   rig.file->name());
      return false;
    }
    if (const std::string changed = changed_include(earlier.stored, rig); !changed.empty()) {
      spdlog::info("{} is not finished, but {} has changed since: a new sweep begins", sweep_file,
                   changed);
      return false;
    }
    record::candidates_refined(sweep_file, earlier.stored.plan, plan);
    return true;
  } catch (const record::FileInUse&) {
    throw;
  } catch (const record::SweepFileError& error) {
    spdlog::warn("{}; a new sweep begins", error.what());
    return false;
  }
}

// By these every other command takes a file for something else than a sweep.
void refuse_other_format(const std::string& output) {
  std::string extension = fs::path{output}.extension().string();
  for (char& each : extension)
    each = static_cast<char>(std::tolower(static_cast<unsigned char>(each)));
  for (const char* other : {".csv", ".txt", ".mat", ".uff", ".unv", ".html", ".json", ".toml"}) {
    if (extension != other) continue;
    throw std::invalid_argument(output + ": a run leaves a sweep file; call it NAME.sweep, and " +
                                "`sinerig export` makes other formats of it");
  }
}

}  // namespace

int run_command(const RunOptions& options, const std::vector<DriverKit>& drivers) {
  refuse_other_format(options.output);
  ConfiguredRig configured{config::RigFile::load(options.rig), drivers};
  const SweepPlan plan = configured.rig().plan();
  if (options.resume) {
    const std::string last = options.output.empty() ? last_output(options.rig) : options.output;
    if (goes_on(last, configured.rig(), plan)) {
      return resume_command(
          {.file = last, .report = options.report, .voice = options.voice, .serve = options.serve},
          drivers);
    }
  }
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
