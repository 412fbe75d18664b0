// Whatever a rig file holds, it is read, checked and planned, or refused with a ConfigError.
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "config/rig.h"
#include "drivers/can/can_driver.h"
#include "drivers/gpio/gpio_driver.h"
#ifdef SINERIG_HAS_MODBUS
#include "drivers/modbus/modbus_driver.h"
#endif
#include "sim/sim_driver.h"

namespace {

using namespace sinerig;

void configure(const config::Rig& rig, const DriverKit& driver) {
  DeviceRequest request{.rig = rig, .actuator = nullptr, .sensors = {}};
  if (rig.actuator.driver == driver.name) request.actuator = &rig.actuator;
  for (const config::Channel& sensor : rig.sensors)
    if (sensor.driver == driver.name) request.sensors.push_back(&sensor);
  if (request.actuator != nullptr || !request.sensors.empty()) driver.configure(request);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::vector<DriverKit> drivers{
      sim::sim_driver(),
      can::can_driver(),
      gpio::gpio_driver([]() -> std::unique_ptr<gpio::LineBank> { return nullptr; }),  // not opened
#ifdef SINERIG_HAS_MODBUS
      modbus::modbus_driver(),
#endif
  };
  try {
    auto file =
        config::RigFile::parse({reinterpret_cast<const char*>(data), size}, "/nowhere/rig.toml");
    const config::Rig rig = config::read_rig(std::move(file));
    for (const DriverKit& driver : drivers) configure(rig, driver);
    rig.file->refuse_unread();
    rig.plan();
  } catch (const config::ConfigError&) {
  }
  return 0;
}
