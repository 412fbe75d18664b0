#include "cli/output_file.h"

#include <filesystem>
#include <fstream>
#include <sstream>
#include <unistd.h>

#include "record/database.h"

namespace sinerig::cli {

namespace {

namespace fs = std::filesystem;

bool fill(const std::string& path, const std::string& text) {
  std::ofstream stream{path, std::ios::binary};
  stream << text;
  stream.close();
  return static_cast<bool>(stream);
}

// Whole or not at all: the new file takes the place and the rights of the old one when it is
// complete. False where nothing may be created beside it.
bool put_in_place(const fs::path& target, const std::string& text) {
  const std::string draft = target.string() + "." + std::to_string(getpid()) + ".new";
  std::error_code failed;
  const fs::file_status old = fs::status(target, failed);
  const bool written = fill(draft, text);
  if (written && fs::exists(old)) fs::permissions(draft, old.permissions(), failed);
  failed.clear();
  if (written) fs::rename(draft, target, failed);
  if (written && !failed) return true;
  std::error_code ignored;
  const bool begun = fs::remove(draft, ignored);
  if (begun) throw record::SweepFileError(target.string() + ": cannot be written");
  return false;
}

}  // namespace

void refuse_existing(const std::string& path, bool force) {
  if (force || !fs::exists(path)) return;
  throw record::FileExists(
      path + ": exists already; choose another name with -o, or --force to replace it");
}

void write_file(const std::string& path, bool force,
                const std::function<void(std::ostream&)>& write) {
  refuse_existing(path, force);
  // Before anything is touched: what fails here leaves what was there.
  std::ostringstream text;
  write(text);
  std::error_code failed;
  const bool linked = fs::is_symlink(path, failed);
  const fs::path target = linked ? fs::weakly_canonical(path, failed) : fs::path{path};
  // A device or a pipe is written to, not replaced.
  const bool replaceable = !fs::exists(target, failed) || fs::is_regular_file(target, failed);
  if (replaceable && put_in_place(target, text.str())) return;
  if (!fill(path, text.str())) throw record::SweepFileError(path + ": cannot be written");
}

}  // namespace sinerig::cli
