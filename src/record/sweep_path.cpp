#include "record/sweep_path.h"

#include <filesystem>

#include "record/file_lock.h"
#include "record/unfinished_run.h"

namespace sinerig::record {

namespace {

void refuse_in_use(const std::string& path) {
  try {
    const FileLock nobody_writes{path, file_in_use};
  } catch (const FileInUse&) {
    throw;
  } catch (const SweepFileError&) {
    // Not ours to write: then it is not ours to resume either.
  }
}

}  // namespace

void remove_sweep_file(const std::string& path) noexcept {
  std::error_code not_there;
  for (const char* suffix : {"", "-wal", "-shm", "-journal", "-spare"}) {
    std::filesystem::remove(path + suffix, not_there);
  }
}

void make_way(const std::string& path, bool replace) {
  if (!std::filesystem::exists(path)) {
    // The log of a file that somebody removed by hand is not that of the new one.
    remove_sweep_file(path);
    return;
  }
  if (!replace) {
    refuse_in_use(path);
    const std::string resumable =
        can_be_resumed(path)
            ? ", and its run was interrupted: `sinerig resume " + path + "` goes on with it"
            : "";
    throw FileExists(path + ": exists already" + resumable +
                     "; choose another name with -o, or --force to replace it");
  }
  const FileLock nobody_writes{path, file_in_use};
  remove_sweep_file(path);
}

}  // namespace sinerig::record
