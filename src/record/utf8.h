// Text as JSON and pages want it, whatever program it came from.
#pragma once

#include <cstddef>
#include <string>

namespace sinerig::record {

// UTF-8 as it is; what is none is taken for Latin-1, as older programs write ° and µ.
std::string as_utf8(const std::string& text);

// At most so many bytes of it, and no half character at the end.
std::string shortened(const std::string& text, std::size_t bytes);

}  // namespace sinerig::record
