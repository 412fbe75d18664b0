// A night in virtual time: a servo with every imperfection, faults at random, the recorder and the
// sweep file as in a real run. Does it end by itself, does memory stay flat, is the file whole, is
// every event explained by what was planted and every plant answered?
//
//   bench_overnight [HOURS [SEED [SECONDS_BETWEEN_FAULTS]]]
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <unistd.h>

#include "overnight_account.h"
#include "overnight_faults.h"
#include "record/recorder.h"
#include "record/sweep_reader.h"
#include "record/sweep_writer.h"
#include "sim/simulated_rig.h"
#include "sweep/outbox.h"
#include "sweep/runner.h"
#include "table.h"

namespace {

using namespace sinerig;
using namespace sinerig::bench;

constexpr double rate_hz = 1000.0;
constexpr double dwell_s = 17.0;  // wait and integration of one dwell
constexpr double stop_ramp_s = 0.05;
constexpr std::size_t responses = 2;

const std::vector<record::ChannelInfo> channels{{"command", "rad"},  {"applied", "rad"},
                                                {"position", "rad"}, {"velocity", "rad/s"},
                                                {"code", "1"},       {"temperature", "°C"}};

sim::SimulatedRigSettings servo(std::uint64_t seed) {
  sim::SimulatedRigSettings rig;
  rig.system = sim::from_mechanical_axis(
      {.inertia = 0.002, .damping = 0.15, .stiffness = 8.0, .gain = 8.0, .modes = {}});
  rig.system.dead_time_s = 0.0023;
  rig.friction = {.coulomb = 0.02, .breakaway = 0.03, .stribeck_velocity = 0.05};
  rig.actuator = {
      .min = -0.6, .max = 0.6, .quantum = 1e-4, .slew_per_s = 50.0, .dropout_fraction = 2e-7};
  rig.seed = seed;
  sim::SimulatedSensor position;
  position.imperfections = {.delay_s = 0.0005,
                            .jitter_s = 0.0002,
                            .noise_rms = 1e-4,
                            .pink_noise_rms = 5e-5,
                            .bias = 0.01,
                            .drift_per_s = 1e-7,
                            .backlash = 2e-4,
                            .quantum = 3.8e-4,
                            .min = -2.0,
                            .max = 2.0,
                            .lost_fraction = 1e-6,
                            .late_fraction = 1e-4};
  sim::SimulatedSensor velocity = position;
  velocity.output = 1;
  velocity.imperfections.noise_rms = 1e-2;
  velocity.imperfections.pink_noise_rms = 0.0;
  velocity.imperfections.jitter_s = 0.0;
  velocity.imperfections.min = -500.0;
  velocity.imperfections.max = 500.0;
  rig.sensors = {position, velocity};
  return rig;
}

SweepPlan plan_of(double hours) {
  SweepSettings sweep;
  sweep.start_hz = 0.5;
  sweep.stop_hz = 60.0;
  sweep.points = static_cast<std::uint32_t>(std::max(2.0, hours * 3600.0 / (1.06 * dwell_s)));
  sweep.frequency_tolerance = 1e-5;
  sweep.amplitude = 0.2;
  sweep.follow_velocity = 6.0;
  sweep.ramp_s = 0.2;
  sweep.offset = 0.05;
  sweep.bias_amplitude = 0.03;
  sweep.bias_hz = 0.11;
  sweep.settling = Settling::fixed;
  sweep.settle = {.cycles = 2.0, .seconds = 1.8};
  sweep.integrate = {.cycles = 4.0, .seconds = 15.0};
  sweep.block = {.cycles = 1.0, .seconds = 0.5};
  sweep.target_db = 0.0;
  sweep.target_deg = 0.0;
  sweep.max_distortion = 0.5;
  return plan_sweep(sweep, {.command_min = -0.5, .command_max = 0.5}, rate_hz);
}

GuardSettings guard_of() {
  GuardSettings guard;
  guard.command_min = -0.5;
  guard.command_max = 0.5;
  guard.max_age_ns = 100'000'000;
  guard.stop_ramp_ticks = static_cast<std::uint64_t>(stop_ramp_s * rate_hz);
  guard.channels.resize(sensor_count);
  ChannelLimits& position = guard.channels[position_sensor];
  position = {.min = -1.5,
              .max = 1.5,
              .soft_min = -0.6,
              .soft_max = 0.6,
              .velocity = {.soft = 500.0, .hard = 1000.0},
              .acceleration = {.hard = 1e6},
              .derivative_filter_s = 0.004,
              .following = {.hard = 3.0}};
  guard.channels[velocity_sensor].max = 400.0;
  guard.channels[code_sensor].allowed = {0.0};
  guard.channels[temperature_sensor] = {.max = 120.0, .soft_max = 70.0};
  return guard;
}

RunnerSettings runner_of() {
  RunnerSettings runner;
  for (std::size_t i = 0; i < responses; ++i)
    runner.responses.push_back({.input = 0, .output = 1 + i, .exact_input = true});
  runner.retry = {.faults = 8,
                  .faults_in_all = 100'000,
                  .wait_s = 5.0,
                  .soft = 5,
                  .soft_in_all = 100'000,
                  .soft_wait_s = 1.0};
  runner.preflight = {.wanted = true, .level = 0.3, .min_gain = 0.5, .max_gain = 2.0};
  return runner;
}

double resident_kib() {
  std::ifstream statm{"/proc/self/statm"};
  double pages = 0.0;
  statm >> pages >> pages;
  return pages * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1024.0;
}

struct Memory {
  double hours;
  double kib;
};

// Of a straight line through the samples, KiB per hour.
double slope(const std::vector<Memory>& samples) {
  const auto count = static_cast<double>(samples.size());
  double hours = 0.0;
  double kib = 0.0;
  for (const Memory& sample : samples) {
    hours += sample.hours / count;
    kib += sample.kib / count;
  }
  double product = 0.0;
  double square = 0.0;
  for (const Memory& sample : samples) {
    product += (sample.hours - hours) * (sample.kib - kib);
    square += (sample.hours - hours) * (sample.hours - hours);
  }
  return square > 0.0 ? product / square : 0.0;
}

std::size_t count(const record::StoredRun& run, const std::string& kind) {
  return static_cast<std::size_t>(std::ranges::count(run.events, kind, &record::StoredEvent::kind));
}

bool integrity(const std::string& path) {
  record::Database database{path, record::Database::Mode::read};
  record::Statement check{database, "PRAGMA integrity_check"};
  return check.step() && check.text(0) == "ok" && !check.step();
}

// Every dwell of the plan has its timing and a point for every response.
bool whole(const record::StoredRun& run, const SweepPlan& plan) {
  if (run.timings.size() != plan.dwells.size() || run.responses.size() != responses) return false;
  return std::ranges::all_of(run.responses, [&](const record::StoredResponse& response) {
    return response.points.size() == plan.dwells.size();
  });
}

struct Outcome {
  RunOutcome run;
  double wall_s = 0.0;
  std::vector<Memory> memory;
};

Outcome live_through(Night& night, const SweepPlan& plan, const std::string& path,
                     std::uint64_t seed) {
  sim::SimulatedRig rig{servo(seed), night.clock()};
  night.stand_before(rig.actuator(), rig.sensor(0), rig.sensor(1));
  std::vector<Sensor*> sensors;
  for (std::size_t i = 0; i < sensor_count; ++i) sensors.push_back(&night.sensor(i));
  record::SweepWriter writer{path,
                             {.rig_name = "overnight",
                              .rig_text = "",
                              .clock = "virtual",
                              .channels = channels,
                              .plan = plan},
                             record::SweepWriter::IfExists::replace};
  Outbox outbox{1U << 12U, 1U << 12U, Outbox::WhenFull::wait};
  Guard guard{guard_of(), 1.0 / rate_hz};
  SweepRunner runner{plan, runner_of(), night.clock(), night, sensors, guard, outbox, &night};
  Outcome outcome;
  std::uint64_t next_sample = 0;
  constexpr std::uint64_t sample_ticks = 60'000;
  // The recorder's thread sees a block every half second or so.
  const auto observe = [&](const Record& record) {
    const auto* block = std::get_if<Block>(&record);
    if (block == nullptr || block->first_tick < next_sample) return;
    next_sample = block->first_tick + sample_ticks;
    outcome.memory.push_back(
        {static_cast<double>(block->first_tick) / rate_hz / 3600.0, resident_kib()});
  };
  record::Recorder recorder{outbox, writer, observe, record::Recorder::Samples::written};
  RunControl control;
  const auto begin = std::chrono::steady_clock::now();
  outcome.run = runner.run(control);
  outbox.close();
  recorder.finish();
  outcome.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  writer.set("outcome", outcome.run.trip.tripped() ? "stopped" : "done");
  writer.finish();
  return outcome;
}

int night_of(double hours, std::uint64_t seed, double every_s) {
  const SweepPlan plan = plan_of(hours);
  // Half as long again: repeated dwells take their time.
  Night night{plant_night(1.5 * hours, rate_hz, every_s, seed), rate_hz};
  const std::string path =
      std::filesystem::temp_directory_path() / ("overnight-" + std::to_string(getpid()) + ".sweep");
  const Outcome outcome = live_through(night, plan, path, seed);
  const record::StoredRun run = record::read_sweep(path);

  Table table;
  table.section("a night, seed " + std::to_string(seed));
  const double night_h = static_cast<double>(night.clock().now().tick) / rate_hz / 3600.0;
  table.at_least("virtual time", night_h, hours, "h");
  table.figure("wall time", outcome.wall_s, "s");
  table.figure("per tick, recorder and all",
               1e9 * outcome.wall_s / static_cast<double>(outcome.run.ticks), "ns");
  table.at_most("ended by the guard, not by itself", outcome.run.trip.tripped() ? 1.0 : 0.0, 0.0,
                "");
  if (outcome.run.trip.tripped())
    table.note(describe(outcome.run.trip, {"position", "velocity", "code", "temperature"}));

  table.section("what was planted, and what became of it");
  const Account account = reconcile(night, run);
  for (const auto& [ill, counts] : account.answered)
    table.at_least(std::string{to_string(ill)} + ", answered", counts.second, counts.first, "");
  table.at_most("planted without an answer", account.unanswered, 0.0, "");
  table.at_most("events without a cause", account.unexplained, 0.0, "");
  const auto& diary = night.diary();
  table.figure("readings lost, each told of", static_cast<double>(diary.sensor_faults.size()), "");
  const auto equal = [&](const std::string& name, std::size_t a, std::size_t b) {
    table.within(name, static_cast<double>(a), static_cast<double>(b), static_cast<double>(b), "");
  };
  equal("armed again, once for every trip", count(run, "rearmed"), count(run, "tripped"));
  equal("attempts to arm that failed", count(run, "rearm_failed"), diary.failed_arms);
  equal("dwells tried lower, once for every soft limit", count(run, "retried"),
        count(run, "limited"));
  equal("pre-flight dwells passed, of both responses", count(run, "preflight"), responses);

  table.section("the file");
  table.at_least("PRAGMA integrity_check is ok", integrity(path) ? 1.0 : 0.0, 1.0, "");
  table.at_least("every dwell has its timing and its points", whole(run, plan) ? 1.0 : 0.0, 1.0,
                 "");
  table.figure("dwells", static_cast<double>(plan.dwells.size()), "");
  std::map<std::string, int> statuses;
  for (const record::StoredResponse& response : run.responses)
    for (const record::StoredPoint& point : response.points) ++statuses[point.status];
  for (const auto& [status, points] : statuses)
    table.figure("points that are " + status, points, "");
  table.at_most("points that are stopped", statuses["stopped"], 0.0, "");

  // The first third is for caches to fill.
  const std::vector<Memory> warm{
      outcome.memory.begin() + static_cast<std::ptrdiff_t>(outcome.memory.size() / 3),
      outcome.memory.end()};
  table.section("memory");
  table.figure("resident at the end", warm.back().kib / 1024.0, "MiB");
  table.figure("slope over the last two thirds", slope(warm), "KiB/h");
  table.at_most("growth over the last two thirds", warm.back().kib - warm.front().kib, 1024.0,
                "KiB");
  std::filesystem::remove(path);
  return table.finish();
}

}  // namespace

int main(int argc, char** argv) {
  const auto argument = [&](int index, double fallback) {
    return argc > index ? std::strtod(argv[index], nullptr) : fallback;
  };
  const double hours = argument(1, 24.0);
  const double every_s = argument(3, 600.0);
  if (!(hours >= 0.05) || !(every_s >= 1.0)) {
    std::fprintf(stderr, "bench_overnight [HOURS >= 0.05 [SEED [SECONDS_BETWEEN_FAULTS >= 1]]]\n");
    return 2;
  }
  return night_of(hours, static_cast<std::uint64_t>(argument(2, 1.0)), every_s) == 0 ? 0 : 1;
}
