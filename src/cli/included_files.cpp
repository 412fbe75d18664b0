#include "cli/included_files.h"

#include <sstream>

namespace sinerig::cli {

std::string included_text(const config::Rig& rig) {
  std::string text;
  for (const auto& [path, digest] : rig.file->included()) {
    if (!text.empty()) text += '\n';
    text += digest;
    text += ", ";
    text += path;
  }
  return text;
}

std::string changed_include(const record::StoredRun& run, const config::Rig& rig) {
  const std::string before = run.fact("included");
  if (before.empty()) return {};
  for (const auto& [path, digest] : rig.file->included()) {
    // A folder that was moved holds the same files.
    std::istringstream lines{before};
    bool same = false;
    for (std::string line; std::getline(lines, line);)
      same = same || line.starts_with(digest + ",");
    if (!same) return path;
  }
  return {};
}

void refuse_changed_include(const record::StoredRun& run, const config::Rig& rig,
                            const std::string& sweep_file) {
  const std::string changed = changed_include(run, rig);
  if (changed.empty()) return;
  throw config::ConfigError(changed + ": has changed since the run of " + sweep_file +
                            " began; put it back to go on with that, or begin anew");
}

}  // namespace sinerig::cli
