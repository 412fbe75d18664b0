// The commands of the program, one function each. They throw; main catches.
#pragma once

#include <string>
#include <vector>

#include "drivers/device.h"
#include "record/compare.h"

namespace sinerig::cli {

enum ExitCode : int {
  exit_done = 0,
  exit_failed = 1,
  exit_usage = 2,        // usage or configuration
  exit_stopped = 3,      // by a limit or a fault
  exit_interrupted = 4,  // by the user; resumable
  exit_changed = 5,      // compare: at least one point differs
};

struct RunOptions {
  std::string rig;
  std::string output;  // empty: NAME.sweep of the rig file, numbered when it exists
  bool force = false;
  bool report = true;  // write NAME.html at the end
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
  std::string channel;          // of svg and png; empty: the first sensor
  bool force = false;
};

struct CompareOptions {
  std::vector<std::string> files;  // the first is what the others are compared with
  record::CompareSettings settings;
  std::string output;  // overlay as a page; empty: none
  bool force = false;
};

int run_command(const RunOptions& options, const std::vector<DriverKit>& drivers);
int plan_command(const std::string& rig, const std::vector<DriverKit>& drivers);
int check_command(const std::string& rig, double seconds, const std::vector<DriverKit>& drivers);
int show_command(const std::string& file);
int export_command(const ExportOptions& options);
int report_command(const ReportOptions& options);
int compare_command(const CompareOptions& options);
int drivers_command(const std::vector<DriverKit>& drivers);

}  // namespace sinerig::cli
