// Whether the loop notices who watches: the same sweep in real time without a live page, with one
// that nobody looks at, and with clients that read, stall or misbehave, in turn in short rounds.
//
//   bench_dashboard [SECONDS [ROUNDS [CLIENTS [CPU]]]]
//
// seconds of each run, 2; rounds, 20; clients, 200; CPU of the loop, the last.
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <unistd.h>

#include "bench/lateness.h"
#include "bench/page_clients.h"
#include "dashboard/live_run.h"
#include "dashboard/server.h"
#include "record/recorder.h"
#include "sim/simulated_rig.h"
#include "sweep/outbox.h"
#include "sweep/runner.h"

namespace {

using namespace sinerig;
using bench::ClientKind;

constexpr double rate_hz = 1000.0;

struct Options {
  int seconds = 2;
  int rounds = 20;
  int clients = 200;
  int cpu = 0;
};

struct Setting {
  const char* name;
  bool page;
  ClientKind kind;
  int clients;  // -1: as many as were asked for
};
constexpr std::array contenders{Setting{"no live page", false, ClientKind::none, 0},
                                Setting{"nobody looks", true, ClientKind::none, 0},
                                Setting{"one that stalls", true, ClientKind::stall, 1},
                                Setting{"all watch", true, ClientKind::watch, -1},
                                Setting{"all stall", true, ClientKind::stall, -1},
                                Setting{"all misbehave", true, ClientKind::misbehave, -1}};

struct Seen {
  bench::Rounds rounds;
  std::uint64_t dropped = 0;  // samples for the page
};

SweepPlan gimbal_plan() {
  SweepSettings sweep;
  sweep.start_hz = 10.0;
  sweep.stop_hz = 200.0;
  sweep.points = 2000;
  sweep.amplitude = 0.2;
  return plan_sweep(sweep, {}, rate_hz);
}

sim::SimulatedRigSettings gimbal() {
  sim::MechanicalAxis axis;
  axis.inertia = 0.02;
  axis.damping = 0.1;
  axis.modes = {{.frequency_hz = 23.0, .damping = 0.01, .residue = 30.0}};
  axis.lag_hz = 150.0;
  sim::SimulatedRigSettings settings;
  settings.system = sim::from_mechanical_axis(axis);
  settings.sensors = {{.output = 0, .imperfections = {.noise_rms = 1e-4}},
                      {.output = 1, .imperfections = {.noise_rms = 1e-4}}};
  return settings;
}

std::vector<record::ChannelInfo> channels() {
  return {{"command", "Nm"}, {"applied", "Nm"}, {"encoder", "rad"}, {"gyro", "rad/s"}};
}

dashboard::LiveSetup live_setup(const SweepPlan& plan, const GuardSettings& limits) {
  record::StoredRun run;
  run.facts = {{"rig_name", "gimbal.toml"}, {"rig_text", ""}};
  run.channels = channels();
  run.plan = plan;
  run.responses = {{1, 2, {}}, {1, 3, {}}};
  return {.label = "gimbal", .run = run, .limits = limits, .in_real_time = true};
}

// As `sinerig run --serve` does it: the loop on its thread, the recorder, the page, a sweep file.
class Run {
 public:
  Run(const Options& options, const Setting& setting, const std::string& sweep_file)
      : options_{options}, setting_{setting}, sweep_file_{sweep_file} {}

  void add_to(Seen& seen) {
    realtime::LoopThread thread{{.priority = 80, .cpu = options_.cpu}};
    const SweepPlan plan = gimbal_plan();
    RunControl control;
    bench::NotingClock clock{rate_hz, static_cast<std::uint64_t>(options_.seconds * rate_hz),
                             control};
    dashboard::Lateness lateness;
    dashboard::WatchedClock watched{clock, lateness};
    GuardSettings limits;
    limits.command_min = -1.0;
    limits.command_max = 1.0;
    limits.channels = {{.min = -10.0, .max = 10.0}, {}};
    std::unique_ptr<dashboard::LiveRun> live;
    std::unique_ptr<dashboard::Server> server;
    if (setting_.page) {
      live = std::make_unique<dashboard::LiveRun>(live_setup(plan, limits), lateness);
      server = std::make_unique<dashboard::Server>(
          dashboard::Server::Settings{.address = dashboard::parse_address(":0"),
                                      .token = dashboard::random_token(),
                                      .stop =
                                          [&control] {
                                            control.stop_requests.fetch_add(1);
                                          }},
          *live);
    }
    record::SweepWriter writer{sweep_file_,
                               {.rig_name = "gimbal.toml",
                                .rig_text = "",
                                .clock = "monotonic",
                                .channels = channels(),
                                .plan = plan},
                               record::SweepWriter::IfExists::replace};
    const int count = setting_.clients < 0 ? options_.clients : setting_.clients;
    const bench::PageClients clients{setting_.kind, count,
                                     server ? server->address().port : std::uint16_t{0}};
    sim::SimulatedRig rig{gimbal(), clock};
    Sensor* const sensors[] = {&rig.sensor(0), &rig.sensor(1)};
    Guard guard{limits, clock.grid().period_s()};
    Outbox outbox{1U << 16U, 1U << 14U, Outbox::WhenFull::keep};
    RunnerSettings settings;
    settings.record_samples = live != nullptr;
    SweepRunner runner{plan,           settings, live ? static_cast<Clock&>(watched) : clock,
                       rig.actuator(), sensors,  guard,
                       outbox};
    record::Recorder recorder{outbox, writer,
                              [&live](const Record& record) {
                                if (live) live->take(record);
                              },
                              record::Recorder::Samples::watched};
    thread.start([&] { runner.run(control); }, [&] { outbox.close(); });
    thread.join();
    recorder.finish();
    writer.finish();
    clients.require();
    seen.rounds.push_back(clock.latency);
    seen.dropped += outbox.dropped_samples();
  }

 private:
  const Options& options_;
  const Setting& setting_;
  const std::string& sweep_file_;
};

double load_average() {
  double average = 0.0;
  getloadavg(&average, 1);
  return average;
}

int compare(const Options& options) {
  const std::string sweep_file =
      (std::filesystem::temp_directory_path() / ("sinerig-bench-" + std::to_string(getpid())))
          .string() +
      ".sweep";
  std::array<Seen, contenders.size()> seen;
  const double before = load_average();
  for (int round = 0; round < options.rounds; ++round) {
    for (std::size_t i = 0; i < contenders.size(); ++i) {
      const std::size_t turn = (i + static_cast<std::size_t>(round)) % contenders.size();
      Run{options, contenders[turn], sweep_file}.add_to(seen[turn]);
    }
  }
  std::filesystem::remove(sweep_file);
  std::printf("\n%d clients; load average %.1f before, %.1f after\n", options.clients, before,
              load_average());
  std::printf("%-16s %9s %9s %9s %9s   %s\n", "late by, µs", "p50", "p99", "p99.9", "most",
              "times that without a page, 95 % interval");
  int missed = 0;
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    const realtime::LatencyHistogram whole = bench::merged(seen[i].rounds);
    std::printf("%-16s", contenders[i].name);
    for (const double part : bench::parts) std::printf(" %9.1f", bench::quantile_us(whole, part));
    std::printf(" %9.0f  ", whole.max_us());
    if (i > 0) {
      for (const bench::Ratio& ratio : bench::ratios(seen[i].rounds, seen[0].rounds)) {
        std::printf(" %4.2f (%4.2f-%4.2f)%s", ratio.value, ratio.least, ratio.most, ratio.mark());
        missed += ratio.surely_above() ? 1 : 0;
      }
    }
    if (seen[i].dropped > 0)
      std::printf("  %llu samples dropped", static_cast<unsigned long long>(seen[i].dropped));
    std::printf("\n");
  }
  return missed;
}

Options options_of(int count, char** arguments) {
  Options options;
  options.cpu = static_cast<int>(sysconf(_SC_NPROCESSORS_ONLN)) - 1;
  int* const values[] = {&options.seconds, &options.rounds, &options.clients, &options.cpu};
  for (int i = 1; i < count && i <= 4; ++i) *values[i - 1] = std::atoi(arguments[i]);
  if (options.seconds < 1 || options.rounds < 1 || options.clients < 1 || options.clients > 250 ||
      options.cpu < 0)
    throw std::invalid_argument(
        "bench dashboard [SECONDS [ROUNDS [CLIENTS [CPU]]]]: whole numbers from 1 on, 250 clients "
        "at most");
  return options;
}

}  // namespace

int main(int count, char** arguments) {
  try {
    if (const auto code = bench::act_as_clients(count, arguments)) return *code;
    const Options options = options_of(count, arguments);
    {
      const realtime::LoopThread trial{{.priority = 80, .cpu = options.cpu}};
      std::printf("1 kHz, CPU %d, %d rounds of %d s each in turn; the loop's thread:\n",
                  options.cpu, options.rounds, options.seconds);
      for (const realtime::Grant& grant : trial.grants())
        std::printf("  %-12s %s\n", to_string(grant.right), grant.state.c_str());
    }
    const int missed = compare(options);
    std::printf("\ngoal 1.1; !: above it, ?: these rounds cannot tell\n");
    return missed == 0 ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_dashboard: %s\n", error.what());
    return 2;
  }
}
