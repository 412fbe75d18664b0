// Slips of the finger in the names of keys, sections and commands.
#pragma once

#include <string_view>

namespace sinerig::config {

// Whether `word` is `wanted` with one slip of the finger in it: a letter too many, too few, wrong
// or swapped with its neighbour, or of the other case. Where a key is missing the others of its
// table have not all been read yet, so a looser likeness would suspect keys that are right.
bool is_misspelt(std::string_view word, std::string_view wanted);

}  // namespace sinerig::config
