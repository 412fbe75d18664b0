#include "cli/commands.h"

#include <iostream>

#include <nlohmann/json.hpp>

#include "cli/configured_rig.h"
#include "cli/measured_run.h"
#include "record/exporters.h"
#include "report/terminal.h"

namespace sinerig::cli {

namespace {

void print_plan_as_json(const config::Rig& rig, const SweepPlan& plan) {
  nlohmann::ordered_json dwells = nlohmann::ordered_json::array();
  for (const Dwell& dwell : plan.dwells) {
    const auto seconds = [&](std::uint64_t samples) {
      return static_cast<double>(samples) / plan.rate_hz;
    };
    nlohmann::ordered_json tones = nlohmann::ordered_json::array();
    for (const Tone& tone : dwell.tones)
      tones.push_back(
          {{"freq_hz", dwell.tone_hz(tone, plan.rate_hz)}, {"amplitude", tone.amplitude}});
    dwells.push_back({{"asked_hz", dwell.asked_hz},
                      {"tones", tones},
                      {"settle_s", seconds(dwell.settle_samples)},
                      {"blocks", dwell.blocks},
                      {"block_s", seconds(dwell.block_samples)},
                      {"least_s", seconds(dwell.min_samples())},
                      {"most_s", seconds(dwell.max_samples)}});
  }
  const nlohmann::ordered_json json{{"rig", rig.file->name()},      {"rate_hz", plan.rate_hz},
                                    {"unit", rig.actuator.unit},    {"least_s", plan.min_seconds()},
                                    {"most_s", plan.max_seconds()}, {"dwells", dwells}};
  std::cout << json.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) << '\n';
}

}  // namespace

int plan_command(const PlanOptions& options, const std::vector<DriverKit>& drivers) {
  const ConfiguredRig configured{options.rig, drivers};
  const config::Rig& rig = configured.rig();
  if (options.json) {
    print_plan_as_json(rig, rig.plan());
  } else {
    report::print_plan(std::cout, rig.plan(), rig.sweep, rig.actuator.unit);
    for (const Remark& remark : configured.remarks()) std::cout << remark.text << '\n';
  }
  return exit_done;
}

int show_command(const ShowOptions& options) {
  const record::StoredRun run = read_run(options.file);
  if (options.json) {
    record::write_json(std::cout, run);
  } else {
    report::print_run(std::cout, run);
  }
  return exit_done;
}

int drivers_command(const std::vector<DriverKit>& drivers) {
  for (const DriverKit& driver : drivers)
    std::cout << driver.name << "  " << driver.summary << '\n';
  return exit_done;
}

}  // namespace sinerig::cli
