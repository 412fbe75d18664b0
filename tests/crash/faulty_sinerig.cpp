// sinerig with the simulated driver, on a disk that fails as SINERIG_FAULTY_DISK orders.
#include <cstdlib>

#include "cli/app.h"
#include "crash/faulty_disk.h"
#include "sim/sim_driver.h"

int main(int argc, char** argv) {
  const char* orders = std::getenv("SINERIG_FAULTY_DISK");
  if (orders != nullptr) sinerig::test::install_faulty_disk(orders);
  return sinerig::cli::run_app(argc, argv, {sinerig::sim::sim_driver()});
}
