#include "cli/commands.h"

#include <iostream>

#include "cli/configured_rig.h"
#include "record/measured.h"
#include "report/terminal.h"

namespace sinerig::cli {

int plan_command(const std::string& rig_path, const std::vector<DriverKit>& drivers) {
  const ConfiguredRig configured{rig_path, drivers};
  const config::Rig& rig = configured.rig();
  report::print_plan(std::cout, rig.plan(), rig.sweep, rig.actuator.unit);
  return exit_done;
}

int show_command(const std::string& file) {
  report::print_run(std::cout, record::read_measured(file));
  return exit_done;
}

int drivers_command(const std::vector<DriverKit>& drivers) {
  for (const DriverKit& driver : drivers)
    std::cout << driver.name << "  " << driver.summary << '\n';
  return exit_done;
}

}  // namespace sinerig::cli
