// The arguments of the commands that take files of responses.
#pragma once

#include <CLI/CLI.hpp>

#include "cli/commands.h"

namespace sinerig::cli {

inline constexpr const char* measured_file =
    "sweep file, or a response measured elsewhere: .csv, .txt, .mat, .uff or .unv";

CLI::App* add_show(CLI::App& app, ShowOptions& options);
CLI::App* add_export(CLI::App& app, ExportOptions& options);
CLI::App* add_report(CLI::App& app, ReportOptions& options);
CLI::App* add_compare(CLI::App& app, CompareOptions& options);

}  // namespace sinerig::cli
