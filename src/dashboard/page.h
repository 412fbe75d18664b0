// The parts of the live page, put into the program by cmake/EmbedText.cmake: its own in
// src/dashboard/page and the plots of the report in src/report/page.
#pragma once

#include <string_view>

namespace sinerig::dashboard {

extern const std::string_view page_template;
extern const std::string_view page_style;
extern const std::string_view page_script;

}  // namespace sinerig::dashboard
