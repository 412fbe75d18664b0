// One writer at a time, whatever becomes of it: the kernel lets go of the lock with the process.
#pragma once

#include <memory>
#include <string>

#include "record/database.h"

namespace sinerig::record {

// A file that another process, or this one, is writing.
class FileInUse : public SweepFileError {
 public:
  using SweepFileError::SweepFileError;
};

// What a sweep file in use is to be told of.
inline constexpr const char* file_in_use =
    "is being written by a sinerig that still runs; wait for it, or stop it with Ctrl-C";

class FileLock {
 public:
  // Locks one byte far beyond the contents of an existing file, out of the way of SQLite's own
  // locks. Throws FileInUse with `who` in it where somebody has it or is just putting another file
  // in its place, SweepFileError where the file cannot be opened for writing.
  //
  // As POSIX has it, closing the file also drops the locks of other handles of this process on it:
  // a lock has to outlive the database that it guards.
  FileLock(const std::string& path, const std::string& who);
  ~FileLock();

  // Makes the file, empty and locked: of several who want the same name one has it. Nothing where
  // there is such a file, or somebody was faster. Throws SweepFileError where none can be made.
  static std::unique_ptr<FileLock> claim(const std::string& path);

  // Whether the locked file is known to stand under this name no more: removed, renamed, or another
  // one in its place. A name that just cannot be looked up says nothing.
  bool displaced(const std::string& path) const noexcept;

  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;

 private:
  explicit FileLock(int descriptor) : descriptor_{descriptor} {}

  int descriptor_ = -1;
};

}  // namespace sinerig::record
