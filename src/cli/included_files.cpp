#include "cli/included_files.h"

#include <sstream>

namespace sinerig::cli {

namespace {

std::string line_of(const std::string& path, const std::string& digest) {
  std::string line = digest;
  line += ", ";
  line += path;
  return line;
}

}  // namespace

std::string included_text(const config::Rig& rig) {
  std::string text;
  for (const auto& [path, digest] : rig.file->included()) {
    if (!text.empty()) text += '\n';
    text += line_of(path, digest);
  }
  return text;
}

std::string changed_include(const record::StoredRun& run, const config::Rig& rig) {
  const std::string before = run.fact("included");
  if (before.empty()) return {};
  for (const auto& [path, digest] : rig.file->included()) {
    std::istringstream lines{before};
    bool same = false;
    for (std::string line; std::getline(lines, line);) same = same || line == line_of(path, digest);
    if (!same) return path;
  }
  return {};
}

}  // namespace sinerig::cli
