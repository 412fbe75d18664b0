// Files that commands write: not over an existing one, and complete or an error.
#pragma once

#include <functional>
#include <iosfwd>
#include <string>
#include <vector>

namespace sinerig::cli {

// Lets `write` make the text, then writes it beside `path` and puts it there: whatever fails leaves
// the file that was there as it was. Throws record::FileExists when it exists and is
// not to be replaced, record::SweepFileError when it cannot be written in full.
void write_file(const std::string& path, bool force,
                const std::function<void(std::ostream&)>& write);

// Throws record::FileExists where `output` is one of the files that it is made from, under whatever
// name. Nothing is written over a measurement.
void refuse_input(const std::string& output, const std::vector<std::string>& inputs);

// Throws record::FileExists as above, and for a sweep file in any case, for writers that open the
// file themselves.
void refuse_existing(const std::string& path, bool force);

}  // namespace sinerig::cli
