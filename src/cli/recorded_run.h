// One part of a run, from the open rig to the closed sweep file: the loop on its own thread, the
// recorder beside it, the story told meanwhile. What `run`, `resume` and `night` have in common.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "cli/commands.h"
#include "cli/configured_rig.h"
#include "record/sweep_writer.h"
#include "record/unfinished_run.h"

namespace sinerig::cli {

// The devices cannot be opened or armed: the drive is off, or boots. What passes by itself.
class DevicesFailed : public std::runtime_error {
 public:
  explicit DevicesFailed(const std::string& what, std::string not_released = {})
      : std::runtime_error{what}, not_released_{std::move(not_released)} {}

  // What the drive has not taken, and may still be on for; empty where it is released.
  const std::string& not_released() const { return not_released_; }

 private:
  std::string not_released_;
};

struct RecordedRunOptions {
  std::string sweep_file;
  Voice voice = Voice::text;
  bool report = true;                  // write NAME.html at the end
  bool table = true;                   // print the points at the end
  std::optional<std::string> serve{};  // as RunOptions::serve
  ServiceNotifier* service = nullptr;  // of a night that goes on behind it; else it has its own
};

// What a sweep file says of a rig before the first tick.
record::RunInfo run_info(const config::Rig& rig, const SweepPlan& plan);

// Opens the file once all that can be refused has been; called once.
using OpenSweepFile = std::function<std::unique_ptr<record::SweepWriter>()>;

// Runs the plan, or what `earlier` has left of it, and returns the exit code. Signals are stop
// requests meanwhile; one that comes before the loop begins leaves no file, and an earlier one as
// it was. Throws where the rig or the file cannot be had, DevicesFailed where its devices fail and
// NotToBeArmed where one of them forbids it: a file that was created for this is gone then, an
// earlier one as it was. Whatever fails later ends the run: actuator released, reason in
// the file where the disk takes it, exit code 3.
int record_run(ConfiguredRig& configured, const SweepPlan& plan, const RecordedRunOptions& options,
               const OpenSweepFile& open_file, const record::UnfinishedRun* earlier = nullptr);

}  // namespace sinerig::cli
