// From keys to registers: reads [modbus.NAME] and the Modbus channels of a rig file.
#pragma once

#include <string>

#include "config/rig.h"
#include "config/section.h"
#include "drivers/modbus/channels.h"

namespace sinerig::modbus {

// What [modbus.NAME] says. Throws config::ConfigError at the key that is wrong, as all below do.
struct Connection {
  LinkSettings link;
  std::uint8_t unit = 1;
};
Connection read_connection(const config::Section& section, double rate_hz);

// The rig's actuator. Its limits must be within what the registers and the clamps can say: a guard
// that admits more would see half a sine, or no neutral.
CommandSettings read_command(const config::Rig& rig, const Connection& connection);
FeedbackSettings read_feedback(const config::Section& section, const Connection& connection);

}  // namespace sinerig::modbus
