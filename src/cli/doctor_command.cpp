#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>

#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "config/rig.h"
#include "realtime/latency.h"
#include "realtime/machine.h"
#include "realtime/remedies.h"
#include "report/terminal.h"

namespace sinerig::cli {

namespace {

using realtime::Finding;
using Json = nlohmann::ordered_json;

constexpr double default_rate_hz = 1000.0;

struct Subject {
  realtime::Settings settings;
  double rate_hz = default_rate_hz;
};

// The drivers' keys are none of the doctor's business.
Subject subject_of(const std::string& rig_path) {
  if (rig_path.empty()) return {};
  const config::Rig rig = config::read_rig(config::RigFile::load(rig_path));
  return {.settings = rig.realtime, .rate_hz = rig.rate_hz};
}

std::vector<Finding> findings_of(const realtime::Grants& grants) {
  std::vector<Finding> findings;
  for (const realtime::Grant& grant : grants)
    findings.push_back({.name = realtime::to_string(grant.right),
                        .ok = grant.granted,
                        .state = grant.state,
                        .remedy = grant.remedy});
  return findings;
}

bool any_missing(const std::vector<Finding>& findings) {
  return std::any_of(findings.begin(), findings.end(),
                     [](const Finding& each) { return !each.ok; });
}

void print_findings(const char* title, const std::vector<Finding>& findings) {
  std::cout << title << '\n';
  for (const Finding& each : findings) {
    char name[64];
    std::snprintf(name, sizeof name, "  %-12s %-8s ", each.name.c_str(),
                  each.ok ? "ok" : "missing");
    std::cout << name << each.state << '\n';
    if (!each.remedy.empty()) std::cout << "                        do: " << each.remedy << '\n';
  }
}

void print_wake_ups(const Subject& subject, const realtime::WakeUps& wake_ups) {
  const realtime::LatencyHistogram& latency = wake_ups.latency;
  char line[256];
  std::snprintf(line, sizeof line,
                "wake-ups, late by\n  p50 %.0f µs, p99 %.0f µs, p99.9 %.0f µs, at most %.0f µs\n"
                "  %llu at %g Hz, %llu skipped, ",
                latency.quantile_us(0.5), latency.quantile_us(0.99), latency.quantile_us(0.999),
                std::floor(latency.max_us()), static_cast<unsigned long long>(latency.count()),
                subject.rate_hz, static_cast<unsigned long long>(wake_ups.skipped));
  std::cout << line << report::usage_text(wake_ups.usage) << '\n';
}

Json json_of(const std::vector<Finding>& findings) {
  Json json = Json::array();
  for (const Finding& each : findings) {
    Json row{{"name", each.name}, {"ok", each.ok}, {"state", each.state}};
    if (!each.remedy.empty()) row["remedy"] = each.remedy;
    json.push_back(row);
  }
  return json;
}

Json json_of(const Subject& subject, const realtime::WakeUps& wake_ups) {
  const realtime::LatencyHistogram& latency = wake_ups.latency;
  Json histogram = Json::array();
  for (const auto& [microseconds, count] : latency.filled_bins())
    histogram.push_back({microseconds, count});
  return {{"rate_hz", subject.rate_hz},
          {"count", latency.count()},
          {"skipped", wake_ups.skipped},
          {"p50_us", latency.quantile_us(0.5)},
          {"p99_us", latency.quantile_us(0.99)},
          {"p99_9_us", latency.quantile_us(0.999)},
          {"max_us", latency.max_us()},
          {"minor_faults", wake_ups.usage.minor_faults},
          {"major_faults", wake_ups.usage.major_faults},
          {"involuntary_switches", wake_ups.usage.involuntary_switches},
          {"histogram_us", histogram}};
}

}  // namespace

int doctor_command(const DoctorOptions& options) {
  const Subject subject = subject_of(options.rig);
  realtime::LoopThread thread{subject.settings};
  const std::vector<Finding> rights = findings_of(thread.grants());
  const std::vector<Finding> machine = realtime::examine_machine(subject.settings);
  if (!options.json) {
    const realtime::Starter starter = realtime::starter();
    print_findings(("rights, started by " + starter.name).c_str(), rights);
    if (realtime::capabilities_would_help(thread.grants()))
      std::cout << "  or for this program alone, whoever starts it: sudo setcap "
                   "cap_sys_nice,cap_ipc_lock=ep "
                << realtime::program_path() << '\n';
    print_findings("machine", machine);
    std::cout.flush();
  }
  const auto wanted =
      static_cast<std::uint64_t>(std::llround(std::ceil(options.seconds * subject.rate_hz)));
  const realtime::WakeUps wake_ups = realtime::measure_wake_ups(thread, subject.rate_hz, wanted);
  if (options.json) {
    const Json json{{"rights", json_of(rights)},
                    {"machine", json_of(machine)},
                    {"wake_ups", json_of(subject, wake_ups)}};
    std::cout << json.dump(1) << '\n';
  } else {
    print_wake_ups(subject, wake_ups);
  }
  const bool ill = any_missing(rights) || any_missing(machine);
  return options.strict && ill ? exit_failed : exit_done;
}

}  // namespace sinerig::cli
