// Lines and fields of comma separated values as programs and spreadsheets write them.
#pragma once

#include <string>
#include <vector>

namespace sinerig::record {

// Without the blanks around it, and without the quotes around a whole field.
std::string trimmed_field(const std::string& text);

// By comma, where there is none by semicolon, else by tab; each trimmed.
std::vector<std::string> fields_of(const std::string& line);

// The whole text is a number as strtod reads it.
bool is_number(const std::string& text);

// Takes off the byte order mark that some programs write in front of the first line.
void drop_byte_order_mark(std::string& first_line);

// Text that a field can hold without ending it: commas, quotes and line ends replaced.
std::string as_field(std::string text);

// Whether these are numbers with decimal commas between semicolons: "0,5;0,2;-0,1". Taken for
// commas between fields they would be others.
bool has_decimal_commas(const std::string& line);

}  // namespace sinerig::record
