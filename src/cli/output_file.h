// Files that commands write: not over an existing one, and complete or an error.
#pragma once

#include <functional>
#include <iosfwd>
#include <string>

namespace sinerig::cli {

// Lets `write` make the text, then writes it beside `path` and puts it there: whatever fails leaves
// the file that was there as it was. Throws record::FileExists when it exists and is
// not to be replaced, record::SweepFileError when it cannot be written in full.
void write_file(const std::string& path, bool force,
                const std::function<void(std::ostream&)>& write);

// Throws record::FileExists as above, for writers that open the file themselves.
void refuse_existing(const std::string& path, bool force);

}  // namespace sinerig::cli
