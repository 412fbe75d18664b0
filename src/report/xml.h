// Text inside XML or HTML.
#pragma once

#include <string>
#include <string_view>

namespace sinerig::report {

// Escaped; what no XML may hold (bytes that are no UTF-8, control characters: names of files have
// them) becomes U+FFFD.
std::string xml_text(std::string_view text);

}  // namespace sinerig::report
