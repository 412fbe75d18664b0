#include "cli/output_file.h"

#include <filesystem>
#include <fstream>
#include <sstream>
#include <unistd.h>

#include "record/sweep_path.h"

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

void refuse_input(const std::string& output, const std::vector<std::string>& inputs) {
  for (const std::string& input : inputs) {
    std::error_code error;
    if (output.empty() || !fs::equivalent(output, input, error) || error) continue;
    throw record::FileExists(output + ": is what is read; choose another name with -o");
  }
}

void refuse_existing(const std::string& path, bool force) {
  if (!fs::exists(path)) return;
  if (record::is_database(path)) {
    throw record::FileExists(path +
                             ": is a sweep file, which only `sinerig run --force` replaces; " +
                             "choose another name with -o");
  }
  if (force) return;
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
