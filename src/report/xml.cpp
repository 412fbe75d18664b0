#include "report/xml.h"

#include <algorithm>
#include <cstdint>

namespace sinerig::report {

namespace {

constexpr const char* replacement = "\xEF\xBF\xBD";

// Bytes of the character that the text begins with; 0 where that is no UTF-8, or none that XML has.
std::size_t length_of_first(std::string_view text) {
  const auto byte = [&](std::size_t i) {
    return static_cast<unsigned char>(text[i]);
  };
  const unsigned char first = byte(0);
  if (first < 0x80U) return first >= 0x20U || first == '\t' || first == '\n' || first == '\r';
  const std::size_t length = first >= 0xF0U ? 4 : first >= 0xE0U ? 3 : 2;
  if (first < 0xC2U || first > 0xF4U || text.size() < length) return 0;
  std::uint32_t code = first & (0xFFU >> (length + 1));
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0U) != 0x80U) return 0;
    code = code << 6U | (byte(i) & 0x3FU);
  }
  constexpr std::uint32_t least[] = {0, 0, 0x80, 0x800, 0x10000};
  const bool surrogate = code >= 0xD800U && code <= 0xDFFFU;
  const bool none = code < least[length] || surrogate || code == 0xFFFEU || code == 0xFFFFU;
  return none || code > 0x10FFFFU ? 0 : length;
}

}  // namespace

std::string xml_text(std::string_view text) {
  std::string safe;
  while (!text.empty()) {
    const std::size_t length = length_of_first(text);
    switch (length == 0 ? '\0' : text.front()) {
      case '\0': safe += replacement; break;
      case '&': safe += "&amp;"; break;
      case '<': safe += "&lt;"; break;
      case '>': safe += "&gt;"; break;
      case '"': safe += "&quot;"; break;
      default: safe += text.substr(0, length);
    }
    text.remove_prefix(std::max<std::size_t>(1, length));
  }
  return safe;
}

}  // namespace sinerig::report
