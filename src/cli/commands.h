// The commands of the program, one function each. They throw; main catches.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/loop_options.h"
#include "drivers/device.h"
#include "record/compare.h"

namespace sinerig::cli {

class ServiceNotifier;

enum ExitCode : int {
  exit_done = 0,
  exit_failed = 1,
  exit_usage = 2,        // usage or configuration
  exit_stopped = 3,      // by a limit or a fault
  exit_interrupted = 4,  // by the user; resumable
  exit_changed = 5,      // compare, night: at least one point differs
};

// What a command says on standard output.
enum class Voice {
  text,   // for people: drawn on a terminal, plain lines elsewhere
  quiet,  // nothing; warnings and errors on standard error remain
  json,   // for scripts
};

struct RunOptions {
  std::string rig;
  std::string output;  // empty: NAME.sweep of the rig file, numbered when it exists
  bool force = false;
  bool resume = false;                    // the last sweep of the rig, where it ended early
  bool report = true;                     // write NAME.html at the end
  Voice voice = Voice::text;              // json: one object per line, plan, points, end
  std::optional<std::string> serve = {};  // ADDR:PORT of the live page; empty: the default
};

struct ResumeOptions {
  std::string file;
  bool report = true;
  bool table = true;  // print the points at the end
  Voice voice = Voice::text;
  std::optional<std::string> serve = {};  // as RunOptions::serve
  ServiceNotifier* service = nullptr;     // of a night that goes on behind it
};

struct NightOptions {
  std::string job;
  Voice voice = Voice::text;  // json: the lines of each run, before it one of type sweep, at last
                              // one of type night
};

struct PlanOptions {
  std::string rig;
  bool json = false;
};

struct CheckOptions {
  std::string rig;
  double seconds = 3.0;
};

struct DoctorOptions {
  std::string rig;       // empty: the defaults of a rig file, at 1 kHz
  double seconds = 5.0;  // of measured wake-ups
  bool strict = false;   // exit code 1 where something is missing
  bool json = false;
};

struct ShowOptions {
  std::string file;
  bool json = false;
};

struct ExportOptions {
  std::string file;
  std::string format = "csv";
  std::string output;   // empty: standard output
  std::string channel;  // empty: the first sensor, or all where the format holds several
  bool force = false;
};

struct ReportOptions {
  std::string file;
  std::string format = "html";  // html, svg or png
  std::string output;           // empty: FILE's name with the format's extension
  std::string channel;          // of the picture and of the loop; empty: the first sensor
  LoopOptions loop;             // with a controller the page shows margins and a notch, too
  bool force = false;
};

struct CompareOptions {
  std::vector<std::string> files;  // the first is what the others are compared with
  record::CompareSettings settings;
  bool drift = false;  // resonances of the models, too; with a controller in `loop` the margins
  LoopOptions loop;
  std::string channel;             // of `drift`
  double tolerance_percent = 0.0;  // of `drift`
  std::string output;              // overlay as a page; empty: none
  bool force = false;
  Voice voice = Voice::text;
};

int run_command(const RunOptions& options, const std::vector<DriverKit>& drivers);
// Goes on with the interrupted run of a sweep file.
int resume_command(const ResumeOptions& options, const std::vector<DriverKit>& drivers);
// The sweeps of a job file, one after the other; called again it goes on where it was.
int night_command(const NightOptions& options, const std::vector<DriverKit>& drivers);
int plan_command(const PlanOptions& options, const std::vector<DriverKit>& drivers);
int show_command(const ShowOptions& options);
int check_command(const CheckOptions& options, const std::vector<DriverKit>& drivers);
int export_command(const ExportOptions& options);
int report_command(const ReportOptions& options);
int compare_command(const CompareOptions& options);
int doctor_command(const DoctorOptions& options);
int drivers_command(const std::vector<DriverKit>& drivers);

}  // namespace sinerig::cli
