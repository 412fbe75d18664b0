// The arguments of the commands that take a rig file.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "cli/commands.h"

namespace sinerig::cli {

CLI::App* add_plan(CLI::App& app, PlanOptions& options);
CLI::App* add_check(CLI::App& app, CheckOptions& options);
CLI::App* add_doctor(CLI::App& app, DoctorOptions& options);
CLI::App* add_run(CLI::App& app, RunOptions& options);
CLI::App* add_night(CLI::App& app, NightOptions& options);
CLI::App* add_resume(CLI::App& app, ResumeOptions& options);

// --quiet and --json, of which only one can be given.
void add_voice(CLI::App& command, Voice& voice, const std::string& quiet_help,
               const std::string& json_help);

// The program's arguments for CLI11, last first. `--serve` may stand alone: what follows is its
// address only when it looks like one.
std::vector<std::string> arguments_of(int argc, char** argv);

}  // namespace sinerig::cli
