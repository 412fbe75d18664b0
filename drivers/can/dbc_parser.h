// The statements of a DBC file that say where signals are, as dbc.h names them.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "drivers/can/dbc.h"

namespace sinerig::can {

// Throws std::runtime_error "FILE:LINE: what, value, rule".
std::vector<DbcMessage> parse_dbc(std::string_view text, const std::string& file_name);

}  // namespace sinerig::can
