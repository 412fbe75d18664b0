#include "cli/run_arguments.h"

#include <algorithm>

#include "dashboard/address.h"

namespace sinerig::cli {

namespace {

constexpr const char* quiet_run = "print warnings and errors only";

// How `run` and `resume` are watched.
template <typename Options>
void add_telling(CLI::App& command, Options& options) {
  command.add_flag_callback(
      "--no-report", [&options] { options.report = false; },
      "do not write the report NAME.html at the end");
  const std::string address = dashboard::Address{}.text();
  command.add_flag(
      "--serve{" + address + "}", options.serve,
      "show the run in a browser while it goes on, with a Stop button; --serve=ADDR:PORT "
      "for elsewhere (default " +
          address + ", for this machine only; port 0: any free one)");
  add_voice(command, options.voice, quiet_run, "print one JSON object per line: plan, points, end");
}

}  // namespace

void add_voice(CLI::App& command, Voice& voice, const std::string& quiet_help,
               const std::string& json_help) {
  CLI::Option* quiet = command.add_flag_callback(
      "--quiet", [&voice] { voice = Voice::quiet; }, quiet_help);
  command
      .add_flag_callback(
          "--json", [&voice] { voice = Voice::json; }, json_help)
      ->excludes(quiet);
}

CLI::App* add_plan(CLI::App& app, PlanOptions& options) {
  CLI::App* plan = app.add_subcommand(
      "plan", "Print every dwell of a rig file and the total duration; refuse what can't be run");
  plan->add_option("RIG", options.rig, "rig file (TOML)")->required();
  plan->add_flag("--json", options.json, "print one JSON object");
  return plan;
}

CLI::App* add_check(CLI::App& app, CheckOptions& options) {
  CLI::App* check = app.add_subcommand(
      "check",
      "Open a rig and read every channel without moving anything: rate, age, jitter, losses, and "
      "what would stop a sweep");
  check->add_option("RIG", options.rig, "rig file (TOML)")->required();
  check->add_option("--seconds", options.seconds, "how long")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  return check;
}

CLI::App* add_doctor(CLI::App& app, DoctorOptions& options) {
  CLI::App* doctor = app.add_subcommand(
      "doctor",
      "Say what this machine gives a loop in real time and how to get the rest, then measure how "
      "late its wake-ups are");
  doctor->add_option(
      "RIG", options.rig,
      "rig file (TOML) whose [loop] counts (default: priority 80, any CPU, 1000 Hz)");
  doctor->add_option("--seconds", options.seconds, "how long to measure")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  doctor->add_flag("--strict", options.strict, "exit code 1 where something is missing");
  doctor->add_flag("--json", options.json, "print one JSON object");
  return doctor;
}

CLI::App* add_run(CLI::App& app, RunOptions& options) {
  CLI::App* run = app.add_subcommand("run", "Run the sweep of a rig file and write a sweep file");
  run->add_option("RIG", options.rig, "rig file (TOML)")->required();
  run->add_option(
      "-o,--output", options.output,
      "sweep file to write (default: RIG's name + .sweep, here; numbered when it exists)");
  CLI::Option* force =
      run->add_flag("--force", options.force, "replace the sweep file if it exists");
  run->add_flag(
         "--resume", options.resume,
         "go on with the last sweep of RIG where that was interrupted, stopped or killed and "
         "RIG is as it was then; begin a new one otherwise")
      ->excludes(force);
  add_telling(*run, options);
  return run;
}

CLI::App* add_resume(CLI::App& app, ResumeOptions& options) {
  CLI::App* resume = app.add_subcommand(
      "resume",
      "Go on with the run of a sweep file that was interrupted, stopped or killed: finished points "
      "stay as they are, the dwell it was interrupted in is repeated");
  resume->add_option("FILE", options.file, "sweep file; the rig file is in it")->required();
  add_telling(*resume, options);
  return resume;
}

CLI::App* add_night(CLI::App& app, NightOptions& options) {
  CLI::App* night = app.add_subcommand(
      "night",
      "Run the sweeps of a job file one after the other, and tell what changed between repeats. "
      "Called again after an interruption it goes on where it was");
  night->add_option("JOB", options.job, "job file (TOML)")->required();
  add_voice(*night, options.voice, quiet_run,
            "print one JSON object per line: sweep, plan, points, end, and at last the night");
  return night;
}

std::vector<std::string> arguments_of(int argc, char** argv) {
  std::vector<std::string> arguments{argv + 1, argv + argc};
  for (std::size_t i = 0; i + 1 < arguments.size(); ++i) {
    const std::string& next = arguments[i + 1];
    const bool address = next.rfind("localhost", 0) == 0 ||
                         next.find_first_not_of("0123456789abcdefABCDEF.:[]") == std::string::npos;
    if (arguments[i] != "--serve" || next.empty() || !address) continue;
    arguments[i] += "=" + next;
    arguments.erase(arguments.begin() + static_cast<std::ptrdiff_t>(i) + 1);
  }
  std::reverse(arguments.begin(), arguments.end());
  return arguments;
}

}  // namespace sinerig::cli
