// How late the loop wakes up, beside cyclictest: both with the same class, priority, CPU and
// period, one after the other in turn, on the machine as it is and under stress-ng.
//
//   bench_realtime [SECONDS [ROUNDS [CPU]]]     seconds of each run, 5; rounds, 12; CPU, the last
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <unistd.h>
#include <vector>

#include <sys/prctl.h>
#include <sys/wait.h>

#include "bench/lateness.h"
#include "sim/simulated_rig.h"
#include "sweep/outbox.h"
#include "sweep/runner.h"

namespace {

using namespace sinerig;
using bench::merged;
using bench::NotingClock;
using bench::parts;
using bench::quantile_us;
using bench::Ratio;
using bench::Rounds;
using realtime::LatencyHistogram;

constexpr double rate_hz = 1000.0;
constexpr int priority = 80;

struct Options {
  int seconds = 5;
  int rounds = 12;
  int cpu = 0;
  bool fifo = true;
};

LatencyHistogram run_cyclictest(const Options& options) {
  std::string command =
      "cyclictest --quiet --threads=1 --mlockall --interval=1000 "
      "--histogram=100000 --affinity=" +
      std::to_string(options.cpu) + " --duration=" + std::to_string(options.seconds);
  command +=
      options.fifo ? " --policy=fifo --priority=" + std::to_string(priority) : " --policy=other";
  LatencyHistogram histogram;
  std::FILE* const output = popen((command + " 2>/dev/null").c_str(), "r");
  if (output == nullptr) throw std::runtime_error("cyclictest cannot be started");
  char line[256];
  while (std::fgets(line, sizeof line, output) != nullptr) {
    unsigned long bin = 0;
    unsigned long count = 0;
    if (line[0] != '#' && std::sscanf(line, "%lu %lu", &bin, &count) == 2)
      histogram.add_bin(bin, count);
  }
  if (pclose(output) != 0 || histogram.count() == 0)
    throw std::runtime_error("failed: " + command + " (Debian package rt-tests)");
  return histogram;
}

realtime::Settings settings_of(const Options& options) {
  return {.priority = priority, .cpu = options.cpu};
}

std::uint64_t wake_ups_of(const Options& options) {
  return static_cast<std::uint64_t>(options.seconds * rate_hz);
}

LatencyHistogram run_waiting(const Options& options) {
  realtime::LoopThread thread{settings_of(options)};
  return realtime::measure_wake_ups(thread, rate_hz, wake_ups_of(options)).latency;
}

// A whole sweep of a simulated gimbal with two sensors, its records taken by another thread.
LatencyHistogram run_sweep(const Options& options) {
  sim::MechanicalAxis axis;
  axis.inertia = 0.02;
  axis.damping = 0.1;
  axis.modes = {{.frequency_hz = 23.0, .damping = 0.01, .residue = 30.0}};
  axis.lag_hz = 150.0;
  sim::SimulatedRigSettings rig_settings;
  rig_settings.system = sim::from_mechanical_axis(axis);
  rig_settings.sensors = {{.output = 0, .imperfections = {.noise_rms = 1e-4}},
                          {.output = 1, .imperfections = {.noise_rms = 1e-4}}};
  SweepSettings sweep;
  sweep.start_hz = 10.0;
  sweep.stop_hz = 200.0;
  sweep.points = 2000;
  sweep.amplitude = 0.2;

  realtime::LoopThread thread{settings_of(options)};
  RunControl control;
  NotingClock clock{rate_hz, wake_ups_of(options), control};
  sim::SimulatedRig rig{rig_settings, clock};
  Sensor* const sensors[] = {&rig.sensor(0), &rig.sensor(1)};
  GuardSettings guard_settings;
  guard_settings.channels.resize(2);
  Guard guard{guard_settings, clock.grid().period_s()};
  Outbox outbox{1U << 16U, 1U << 14U, Outbox::WhenFull::keep};
  SweepRunner runner{
      plan_sweep(sweep, {}, rate_hz), {}, clock, rig.actuator(), sensors, guard, outbox};
  std::thread taker{[&outbox] {
    for (Record record; !outbox.closed();) {
      while (outbox.try_take(record)) {
      }
      std::this_thread::sleep_for(std::chrono::milliseconds{2});
    }
  }};
  thread.start([&] { runner.run(control); }, [&] { outbox.close(); });
  thread.join();
  taker.join();
  return clock.latency;
}

// stress-ng for as long as it lives; it goes with this program.
class Load {
 public:
  explicit Load(bool wanted) {
    if (!wanted) return;
    child_ = fork();
    if (child_ != 0) return;
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    execlp("stress-ng", "stress-ng", "--quiet", "--cpu", "0", "--vm", "1", "--vm-bytes", "256M",
           "--hdd", "1", "--hdd-bytes", "64M", "--temp-path", "/tmp", nullptr);
    std::_Exit(127);
  }
  ~Load() {
    if (child_ <= 0) return;
    kill(child_, SIGTERM);
    waitpid(child_, nullptr, 0);
  }
  Load(const Load&) = delete;
  Load& operator=(const Load&) = delete;

  void require() const {
    if (child_ > 0 && waitpid(child_, nullptr, WNOHANG) == child_)
      throw std::runtime_error("stress-ng did not start (Debian package stress-ng)");
  }

 private:
  pid_t child_ = -1;
};

struct Contender {
  const char* name;
  LatencyHistogram (*run)(const Options&);
};
constexpr std::array contenders{Contender{"cyclictest", run_cyclictest},
                                Contender{"sinerig, waiting", run_waiting},
                                Contender{"sinerig, whole loop", run_sweep}};

// Ratios that are above the goal for certain.
int compare(const char* title, bool loaded, const Options& options) {
  const Load load{loaded};
  std::this_thread::sleep_for(std::chrono::seconds{1});
  load.require();
  std::array<Rounds, contenders.size()> seen;
  for (int round = 0; round < options.rounds; ++round) {
    for (std::size_t i = 0; i < contenders.size(); ++i) {
      const std::size_t turn = (i + static_cast<std::size_t>(round)) % contenders.size();
      seen[turn].push_back(contenders[turn].run(options));
    }
  }
  double average = 0.0;
  getloadavg(&average, 1);
  std::printf("\n%s, load average %.1f\n%-20s %9s %9s %9s %9s   %s\n", title, average,
              "late by, µs", "p50", "p99", "p99.9", "most", "parts of cyclictest's, 95 % interval");
  int missed = 0;
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    const LatencyHistogram whole = merged(seen[i]);
    std::printf("%-20s", contenders[i].name);
    for (const double part : parts) std::printf(" %9.1f", quantile_us(whole, part));
    std::printf(" %9.0f  ", whole.max_us());
    if (i > 0) {
      for (const Ratio& ratio : bench::ratios(seen[i], seen[0])) {
        std::printf(" %4.2f (%4.2f-%4.2f)%s", ratio.value, ratio.least, ratio.most, ratio.mark());
        missed += ratio.surely_above() ? 1 : 0;
      }
    }
    std::printf("\n");
  }
  return missed;
}

Options options_of(int count, char** arguments) {
  Options options;
  options.cpu = static_cast<int>(sysconf(_SC_NPROCESSORS_ONLN)) - 1;
  int* const values[] = {&options.seconds, &options.rounds, &options.cpu};
  for (int i = 1; i < count && i <= 3; ++i) *values[i - 1] = std::atoi(arguments[i]);
  if (options.seconds < 1 || options.rounds < 1 || options.cpu < 0)
    throw std::invalid_argument("bench realtime [SECONDS [ROUNDS [CPU]]]: whole numbers from 1 on");
  return options;
}

}  // namespace

int main(int count, char** arguments) {
  try {
    Options options = options_of(count, arguments);
    {
      const realtime::LoopThread trial{settings_of(options)};
      options.fifo = trial.grants().front().granted;
      std::printf("1 kHz, CPU %d, %d rounds of %d s each in turn; the loop's thread:\n",
                  options.cpu, options.rounds, options.seconds);
      for (const realtime::Grant& grant : trial.grants())
        std::printf("  %-12s %s\n", to_string(grant.right), grant.state.c_str());
      if (!options.fifo)
        std::printf("  without SCHED_FIFO: cyclictest runs in the ordinary class, too\n");
    }
    const int missed =
        compare("as it is", false, options) + compare("under stress-ng", true, options);
    std::printf("\ngoal 1.1; !: above it, ?: these rounds cannot tell\n");
    return missed == 0 ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_realtime: %s\n", error.what());
    return 2;
  }
}
