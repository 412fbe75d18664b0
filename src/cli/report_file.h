// The report beside a sweep file.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace sinerig::cli {

// NAME.html for NAME.sweep.
std::string report_path(const std::string& sweep_file);

// True for a page that this program wrote: it may be replaced without asking.
bool is_report(const std::string& path);

// Reads the sweep file and writes its report to `path`; `loop` is a loop_panel or null. Throws
// record::FileExists when something else is there and is not to be replaced.
void write_report(const std::string& sweep_file, const std::string& path, bool force,
                  const nlohmann::ordered_json& loop = {});

}  // namespace sinerig::cli
