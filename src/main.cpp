// The composition root: the only file that knows every driver.
#include "cli/app.h"
#include "drivers/can/can_driver.h"
#ifdef SINERIG_HAS_MODBUS
#include "drivers/modbus/modbus_driver.h"
#endif
#include "sim/sim_driver.h"

int main(int argc, char** argv) {
  return sinerig::cli::run_app(argc, argv,
                               {
                                   sinerig::sim::sim_driver(),
                                   sinerig::can::can_driver(),
#ifdef SINERIG_HAS_MODBUS
                                   sinerig::modbus::modbus_driver(),
#endif
                               });
}
