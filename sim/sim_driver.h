// The driver "sim": reads [plant] and the imperfections of the actuator and the sensors.
#pragma once

#include "drivers/device.h"
#include "sim/simulated_rig.h"

namespace sinerig::sim {

// The plant that [plant] describes. Throws config::ConfigError.
LinearSystem read_plant(const config::Section& plant);

DriverKit sim_driver();

}  // namespace sinerig::sim
