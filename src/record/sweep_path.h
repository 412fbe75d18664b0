// What stands where a sweep file is to be.
#pragma once

#include <string>

namespace sinerig::record {

// Makes the path free for a new file. Throws FileExists where there is one that is not to be
// replaced, saying whether it can be resumed; FileInUse where one is being written.
void make_way(const std::string& path, bool replace);

// The file with what SQLite and SpareRoom may have left beside it.
void remove_sweep_file(const std::string& path) noexcept;

}  // namespace sinerig::record
