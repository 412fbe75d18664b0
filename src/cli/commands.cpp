#include "cli/commands.h"

#include <iostream>

#include "cli/chosen_response.h"
#include "cli/configured_rig.h"
#include "cli/output_file.h"
#include "record/exporters.h"
#include "record/sweep_reader.h"
#include "report/terminal.h"

namespace sinerig::cli {

namespace {

void export_to(std::ostream& stream, const record::StoredRun& run, const ExportOptions& options) {
  if (options.format == "json") {
    write_json(stream, run);
  } else {
    write_csv(stream, run, chosen_response(run, options.file, options.channel));
  }
}

}  // namespace

int plan_command(const std::string& rig_path, const std::vector<DriverKit>& drivers) {
  const ConfiguredRig configured{rig_path, drivers};
  const config::Rig& rig = configured.rig();
  report::print_plan(std::cout, rig.plan(), rig.sweep, rig.actuator.unit);
  return exit_done;
}

int show_command(const std::string& file) {
  report::print_run(std::cout, record::read_sweep(file));
  return exit_done;
}

int export_command(const ExportOptions& options) {
  const record::StoredRun run = record::read_sweep(options.file);
  if (options.output.empty()) {
    export_to(std::cout, run, options);
    return exit_done;
  }
  write_file(options.output, options.force,
             [&](std::ostream& stream) { export_to(stream, run, options); });
  return exit_done;
}

int drivers_command(const std::vector<DriverKit>& drivers) {
  for (const DriverKit& driver : drivers)
    std::cout << driver.name << "  " << driver.summary << '\n';
  return exit_done;
}

}  // namespace sinerig::cli
