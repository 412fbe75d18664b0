// The parts of the report's page, put into the program by cmake/EmbedText.cmake from
// src/report/page.
#pragma once

#include <string_view>

namespace sinerig::report {

extern const std::string_view page_template;
extern const std::string_view page_style;
extern const std::string_view page_script;

}  // namespace sinerig::report
