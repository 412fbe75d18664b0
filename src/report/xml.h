// Text inside XML or HTML.
#pragma once

#include <string>
#include <string_view>

namespace sinerig::report {

inline std::string xml_text(std::string_view text) {
  std::string safe;
  for (const char each : text) {
    switch (each) {
      case '&': safe += "&amp;"; break;
      case '<': safe += "&lt;"; break;
      case '>': safe += "&gt;"; break;
      case '"': safe += "&quot;"; break;
      default: safe += each;
    }
  }
  return safe;
}

}  // namespace sinerig::report
