#include "record/csv_text.h"

#include <algorithm>
#include <cstdlib>
#include <sstream>

namespace sinerig::record {

std::string trimmed_field(const std::string& text) {
  constexpr const char* blanks = " \t\r\"\f\v";
  const auto first = text.find_first_not_of(blanks);
  if (first == std::string::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

std::vector<std::string> fields_of(const std::string& line) {
  const char separator = line.find(',') != std::string::npos   ? ','
                         : line.find(';') != std::string::npos ? ';'
                                                               : '\t';
  std::vector<std::string> fields;
  for (std::size_t begin = 0;;) {
    const std::size_t end = line.find(separator, begin);
    fields.push_back(trimmed_field(line.substr(begin, end - begin)));
    if (end == std::string::npos) return fields;
    begin = end + 1;
  }
}

bool is_number(const std::string& text) {
  char* end = nullptr;
  std::strtod(text.c_str(), &end);
  return !text.empty() && *end == '\0';
}

void drop_byte_order_mark(std::string& first_line) {
  if (first_line.rfind("\xEF\xBB\xBF", 0) == 0) first_line.erase(0, 3);
}

std::string as_field(std::string text) {
  for (char& each : text) {
    if (each == ',') each = ';';
    if (each == '"') each = '\'';
    if (static_cast<unsigned char>(each) < 0x20) each = ' ';
  }
  return text;
}

bool has_decimal_commas(const std::string& line) {
  if (line.find(';') == std::string::npos || line.find(',') == std::string::npos) return false;
  std::istringstream fields{line};
  for (std::string field; std::getline(fields, field, ';');) {
    std::replace(field.begin(), field.end(), ',', '.');
    field = trimmed_field(field);
    if (!field.empty() && !is_number(field)) return false;
  }
  return true;
}

}  // namespace sinerig::record
