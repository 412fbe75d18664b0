// The composition root: the only file that knows every driver.
#include "cli/app.h"
#include "drivers/can/can_driver.h"
#ifdef SINERIG_HAS_MODBUS
#include "drivers/modbus/modbus_driver.h"
#endif
#include "sim/sim_driver.h"
#ifdef SINERIG_GPIO
#include "drivers/gpio/gpio_driver.h"
#include "drivers/gpio/libgpiod.h"
#endif

int main(int argc, char** argv) {
  std::vector<sinerig::DriverKit> drivers{sinerig::sim::sim_driver(), sinerig::can::can_driver()};
#ifdef SINERIG_HAS_MODBUS
  drivers.push_back(sinerig::modbus::modbus_driver());
#endif
#ifdef SINERIG_GPIO
  drivers.push_back(sinerig::gpio::gpio_driver(sinerig::gpio::kernel_lines));
#endif
  return sinerig::cli::run_app(argc, argv, drivers);
}
