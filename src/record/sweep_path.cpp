#include "record/sweep_path.h"

#include <filesystem>
#include <fstream>
#include <string_view>

#include "record/file_lock.h"
#include "record/unfinished_run.h"

namespace sinerig::record {

namespace {

namespace fs = std::filesystem;

void refuse_in_use(const std::string& path) {
  try {
    const FileLock nobody_writes{path, file_in_use};
  } catch (const FileInUse&) {
    throw;
  } catch (const SweepFileError&) {
    // Not ours to write: then it is not ours to resume either.
  }
}

constexpr const char* old = "-old";

// Puts the last points of a killed run from the log into the file: a file without a log is moved at
// one stroke.
void empty_log(const std::string& path) noexcept {
  try {
    Database database{path, Database::Mode::write};
    database.pragma("wal_checkpoint(TRUNCATE)");
  } catch (const SweepFileError&) {
    // No sweep file, or no room for it: then the log goes along.
  }
}

// The file goes last: killed in between it still stands under its old name.
std::error_code move_sweep_file(const std::string& from, const std::string& to) noexcept {
  remove_sweep_file(to);
  empty_log(from);
  std::error_code error;
  for (const char* suffix : {"-wal", "-journal", ""}) {
    if (std::filesystem::exists(from + suffix, error)) {
      std::filesystem::rename(from + suffix, to + suffix, error);
    }
    if (error) break;
  }
  if (!error) remove_sweep_file(from);
  return error;
}

// Of a run that was killed before it had taken the place of another. What cannot be read may be
// worth something.
bool without_a_part(const std::string& path) {
  try {
    if (!is_begun(path)) return true;
    Database database{path, Database::Mode::read};
    Statement parts{database, "SELECT 1 FROM part"};
    return !parts.step();
  } catch (const SweepFileError&) {
    return false;
  }
}

void set_aside(const std::string& path) {
  // The one that was to be replaced then is the one that is to be replaced now.
  if (std::filesystem::exists(path + old) && without_a_part(path)) {
    remove_sweep_file(path);
    return;
  }
  if (const std::error_code error = move_sweep_file(path, path + old)) {
    throw SweepFileError(path + ": cannot be set aside: " + error.message());
  }
}

// Throws where there is one that is not to be replaced, saying whether it can be resumed, or one
// that is being written; sets aside one that is to be replaced.
void make_way(const std::string& path, bool replace) {
  if (!std::filesystem::exists(path)) return;
  if (!replace) {
    refuse_in_use(path);
    const std::string resumable =
        can_be_resumed(path)
            ? ", and its run was interrupted: `sinerig resume " + path + "` goes on with it"
            : "";
    throw FileExists(path + ": exists already" + resumable +
                     "; choose another name with -o, or --force to replace it");
  }
  if (!fs::is_regular_file(path) || (fs::file_size(path) > 0 && !is_database(path))) {
    throw FileExists(path + ": is not a sweep file, and nothing else is replaced; choose another " +
                     "name with -o");
  }
  const FileLock nobody_writes{path, file_in_use};
  set_aside(path);
}

}  // namespace

bool is_database(const std::string& path) noexcept {
  try {
    if (!fs::is_regular_file(path)) return false;
    std::ifstream stream{path, std::ios::binary};
    char magic[15] = {};
    stream.read(magic, sizeof magic);
    return stream && std::string_view{magic, sizeof magic} == "SQLite format 3";
  } catch (const std::exception&) {
    return false;
  }
}

void remove_leftovers(const std::string& path) noexcept {
  std::error_code not_there;
  for (const char* suffix : {"-wal", "-shm", "-journal", "-spare"}) {
    std::filesystem::remove(path + suffix, not_there);
  }
}

void remove_sweep_file(const std::string& path) noexcept {
  std::error_code not_there;
  std::filesystem::remove(path, not_there);
  remove_leftovers(path);
}

void drop_old(const std::string& path) noexcept {
  remove_sweep_file(path + old);
}

void put_old_back(const std::string& path) noexcept {
  remove_sweep_file(path);
  std::error_code error;
  if (std::filesystem::exists(path + old, error)) move_sweep_file(path + old, path);
}

std::unique_ptr<FileLock> claim_path(const std::string& path, bool replace) {
  std::unique_ptr<FileLock> claimed;
  while (!claimed) {
    make_way(path, replace);
    claimed = FileLock::claim(path);
  }
  // The log of a file that somebody removed by hand is not that of the new one.
  remove_leftovers(path);
  return claimed;
}

}  // namespace sinerig::record
