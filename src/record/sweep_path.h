// What stands where a sweep file is to be.
#pragma once

#include <memory>
#include <string>

#include "record/file_lock.h"

namespace sinerig::record {

// Whether this is a file of SQLite, by its first bytes: a sweep file, or one that is damaged.
bool is_database(const std::string& path) noexcept;

// An empty file under this name, locked. Throws FileExists where there is one that is not to be
// replaced, saying whether it can be resumed; FileInUse where one is being written; SweepFileError
// where none can be made. One that is to be replaced is set aside, as NAME.sweep-old, until either
// of the two below.
std::unique_ptr<FileLock> claim_path(const std::string& path, bool replace);

// The new file has taken the place of the old one for good.
void drop_old(const std::string& path) noexcept;

// The new file came to nothing: the old one stands where it stood. No database may be open on
// either, it would take the log of the other for its own.
void put_old_back(const std::string& path) noexcept;

// What SQLite and SpareRoom may have left beside a file.
void remove_leftovers(const std::string& path) noexcept;

// The file with what SQLite and SpareRoom may have left beside it.
void remove_sweep_file(const std::string& path) noexcept;

}  // namespace sinerig::record
