// The driver "can": actuators and sensors on SocketCAN interfaces, described in the rig file or by
// a device profile of config/devices.
#pragma once

#include "drivers/device.h"

namespace sinerig::can {

DriverKit can_driver();

}  // namespace sinerig::can
