// From keys to registers: reads [modbus.NAME] and the Modbus channels of a rig file.
#pragma once

#include <string>

#include "config/section.h"
#include "drivers/modbus/channels.h"

namespace sinerig::modbus {

// What [modbus.NAME] says. Throws config::ConfigError at the key that is wrong, as all below do.
struct Connection {
  LinkSettings link;
  std::uint8_t unit = 1;
};
Connection read_connection(const config::Section& section, double rate_hz);

CommandSettings read_command(const config::Section& section, const Connection& connection,
                             double neutral, std::int64_t max_age_ns);
FeedbackSettings read_feedback(const config::Section& section, const Connection& connection);

}  // namespace sinerig::modbus
