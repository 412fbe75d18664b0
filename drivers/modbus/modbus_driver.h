// The driver "modbus": actuators and sensors in the registers of Modbus devices, TCP and RTU.
#pragma once

#include "drivers/device.h"

namespace sinerig::modbus {

DriverKit modbus_driver();

}  // namespace sinerig::modbus
