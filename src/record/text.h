// printf into a string, for tables and messages.
#pragma once

#include <string>

namespace sinerig::record {

// As std::printf would print it, of any length.
[[gnu::format(printf, 1, 2)]] std::string text(const char* format, ...);

}  // namespace sinerig::record
