#include <cstdio>
#include <iostream>

#include "cli/channel_check.h"
#include "cli/commands.h"
#include "cli/configured_rig.h"
#include "cli/real_time.h"
#include "cli/stop_on_signal.h"

namespace sinerig::cli {

namespace {

template <class... Values>
void print(const char* format, Values... values) {
  char line[512];
  std::snprintf(line, sizeof line, format, values...);
  std::cout << line;
}

void print_channels(const RigCheck& check, const config::Rig& rig) {
  print("%-14s %9s %9s %9s %9s %10s %6s  %s\n", "", "", "age ms", "", "", "", "", "");
  print("%-14s %9s %9s %9s %9s %10s %6s  %s\n", "channel", "rate Hz", "median", "99 %", "most",
        "jitter ms", "lost", "value");
  for (std::size_t i = 0; i < check.channels.size(); ++i) {
    const ChannelCheck& channel = check.channels[i];
    print("%-14s %9.2f %9.3f %9.3f %9.3f %10.4f %6llu  ", rig.sensors[i].name.c_str(),
          channel.rate_hz, channel.age_median_s * 1e3, channel.age_99_s * 1e3,
          channel.age_most_s * 1e3, channel.jitter_s * 1e3,
          static_cast<unsigned long long>(channel.lost));
    if (channel.samples > 0)
      print("%.6g %s\n", channel.last_value, rig.sensors[i].unit.c_str());
    else
      print("%s\n", channel.answers_command ? "answers set-points only" : "none");
    for (const Fault fault : {Fault::timeout, Fault::bus, Fault::range, Fault::device}) {
      if (channel.faulty(fault) == 0) continue;
      print("%-14s %llu of %llu readings had the fault \"%s\"\n", "",
            static_cast<unsigned long long>(channel.faulty(fault)),
            static_cast<unsigned long long>(check.loop.ticks), to_string(fault));
    }
  }
}

std::string refusal_of_plan(const config::Rig& rig) {
  try {
    rig.plan();
  } catch (const config::ConfigError& refused) {
    return refused.what();
  }
  return "";
}

std::vector<std::string> obstacles(const RigCheck& check, const config::Rig& rig,
                                   const std::vector<Remark>& remarks) {
  std::vector<std::string> found;
  if (const std::string refusal = refusal_of_plan(rig); !refusal.empty()) found.push_back(refusal);
  for (std::size_t i = 0; i < check.channels.size(); ++i) {
    const ChannelCheck& channel = check.channels[i];
    if (channel.silent_as_it_should_be()) continue;
    if (channel.trip.tripped())
      found.push_back(describe_cause(channel.trip, {rig.sensors[i].name}));
    else if (channel.samples == 0)
      found.push_back(rig.sensors[i].name + " has not given a single good sample");
  }
  for (const Remark& remark : remarks)
    if (remark.stops_a_sweep) found.push_back(remark.text);
  return found;
}

// As a sweep would: with the rights that its loop has.
RigCheck check_on(realtime::LoopThread& loop, ConfiguredRig& configured, double seconds) {
  ChannelCheckRun check{configured.clock(), configured.sensors(), configured.rig().guard};
  loop.start([&] { check.read(seconds, configured.control()); }, {});
  loop.join();
  return check.evaluate();
}

}  // namespace

int check_command(const CheckOptions& options, const std::vector<DriverKit>& drivers) {
  ConfiguredRig configured{options.rig, drivers};
  const config::Rig& rig = configured.rig();
  const StopOnSignal stop_on_signal{configured.control()};  // closes the devices in good order
  const std::unique_ptr<realtime::LoopThread> loop = make_loop_thread(rig);
  try {
    configured.open();
  } catch (const StopRequested&) {
    std::cout << "stop requested before anything was read\n";
    return exit_interrupted;
  }
  RigCheck check = check_on(*loop, configured, options.seconds);
  for (std::size_t i = 0; i < check.channels.size(); ++i)
    check.channels[i].answers_command = configured.answers_command(i);
  const std::vector<Remark> remarks = configured.remarks();

  const bool in_virtual_time = rig.clock == config::ClockKind::virtual_time;
  print("rig      %s, %g Hz, %s clock; nothing is moved\n", rig.file->name().c_str(), rig.rate_hz,
        in_virtual_time ? "virtual" : "monotonic");
  print("loop     %llu ticks, %llu skipped, late by %.1f µs (99 %%), %.1f µs at most\n",
        static_cast<unsigned long long>(check.loop.ticks),
        static_cast<unsigned long long>(check.loop.skipped), check.loop.lateness_99_s * 1e6,
        check.loop.lateness_most_s * 1e6);
  print_channels(check, rig);
  for (const Remark& remark : remarks)
    if (!remark.stops_a_sweep) std::cout << remark.text << '\n';
  const std::vector<std::string> found = obstacles(check, rig, remarks);
  if (found.empty()) {
    std::cout << "nothing was found that would stop a sweep\n";
    return configured.control().stop_requests.load() > 0 ? exit_interrupted : exit_done;
  }
  std::cout << "would stop a sweep:\n";
  for (const std::string& what : found) std::cout << "  " << what << '\n';
  return exit_stopped;
}

}  // namespace sinerig::cli
