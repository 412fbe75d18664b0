#include "cli/live_view.h"

#include <filesystem>

#include <spdlog/spdlog.h>

#include "version.h"

namespace sinerig::cli {

namespace {

dashboard::LiveSetup setup_of(const config::Rig& rig, const SweepPlan& plan,
                              const RunControl& control) {
  const bool in_real_time = rig.clock == config::ClockKind::monotonic;
  dashboard::LiveSetup setup{.label = std::filesystem::path{rig.file->name()}.stem().string(),
                             .run = {},
                             .limits = rig.guard,
                             .in_real_time = in_real_time,
                             .preflight = rig.runner.preflight.wanted,
                             .stop_requests = [&control] {
                               return control.stop_requests.load();
                             }};
  record::StoredRun& run = setup.run;
  run.facts = {{"rig_name", rig.file->name()},
               {"rig_text", rig.file->text()},
               {"clock", in_real_time ? "monotonic" : "virtual"},
               {"sinerig", version}};
  run.plan = plan;
  run.channels = {{"command", rig.actuator.unit}, {"applied", rig.actuator.unit}};
  for (const config::Channel& sensor : rig.sensors) {
    run.channels.push_back({sensor.name, sensor.unit});
    const auto output = static_cast<std::uint32_t>(run.channels.size() - 1);
    if (rig.runner.responses.empty()) run.responses.push_back({applied_channel, output, {}});
  }
  for (const Pair& pair : rig.runner.responses) {
    run.responses.push_back({static_cast<std::uint32_t>(applied_channel + pair.input),
                             static_cast<std::uint32_t>(applied_channel + pair.output),
                             {}});
  }
  for (record::StoredResponse& response : run.responses) response.hold_rate_hz = plan.rate_hz;
  return setup;
}

}  // namespace

LiveView::LiveView(const std::string& address, const config::Rig& rig, const SweepPlan& plan,
                   Clock& clock, RunControl& control)
    : clock_{clock, lateness_},
      run_{setup_of(rig, plan, control), lateness_},
      server_{{.address = dashboard::parse_address(address),
               .token = dashboard::random_token(),
               .stop =
                   [&control] {
                     control.stop_requests.fetch_add(1);
                   }},
              run_} {
  if (rig.clock == config::ClockKind::virtual_time) {
    spdlog::warn(
        "--serve: on a virtual clock the run is over at once, and the page with it; clock = "
        "\"monotonic\" in [loop] runs it in real time");
  }
  if (!server_.address().loopback()) {
    spdlog::warn("{} can be reached from the network: whoever can may watch, without encryption",
                 server_.address().text());
  }
}

void LiveView::finish(const RunEnd& end) {
  std::vector<std::string> files;
  if (!end.sweep_file.empty()) files.push_back(end.sweep_file);
  if (!end.report_file.empty()) files.push_back(end.report_file);
  run_.finish({.outcome = end.outcome, .detail = end.reason, .files = files});
}

}  // namespace sinerig::cli
