#include "realtime/machine.h"

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <sys/utsname.h>

namespace sinerig::realtime {

namespace {

namespace fs = std::filesystem;

// The first line of a file; empty where there is none.
std::string line_of(const fs::path& path) {
  std::ifstream file{path};
  std::string line;
  std::getline(file, line);
  return line;
}

bool has_word(const std::string& text, const std::string& wanted) {
  std::istringstream words{text};
  for (std::string word; words >> word;)
    if (word == wanted) return true;
  return false;
}

class Examination {
 public:
  Examination(const Settings& settings, const std::string& root)
      : settings_{settings}, cpus_{root + "/sys/devices/system/cpu"}, root_{root} {}

  Finding kernel() const {
    Finding found{.name = "kernel", .ok = false, .state = {}, .remedy = {}};
    // The patches' kernels have the first, those since 6.12 the second: "#1 SMP PREEMPT_RT …".
    found.ok = line_of(root_ + "/sys/kernel/realtime") == "1" ||
               has_word(line_of(root_ + "/proc/sys/kernel/version"), "PREEMPT_RT");
    utsname host{};
    uname(&host);
    const std::string release = host.release;
    found.state = release + (found.ok ? ", PREEMPT_RT" : ", not PREEMPT_RT");
    if (!found.ok) found.remedy = realtime_kernel(host.machine);
    return found;
  }

  // `file`: isolated or nohz_full, lists of CPUs.
  Finding apart(const std::string& name, const std::string& file,
                const std::string& meaning) const {
    Finding found{.name = name, .ok = false, .state = {}, .remedy = {}};
    const std::string text = line_of(cpus_ / file);
    const std::vector<int> apart = cpu_list(text);
    found.ok = settings_.cpu ? std::find(apart.begin(), apart.end(), *settings_.cpu) != apart.end()
                             : !apart.empty();
    const std::string which = settings_.cpu ? "CPU " + std::to_string(*settings_.cpu) : "no CPU";
    if (found.ok && !settings_.cpu) {
      found.ok = false;
      found.state = "CPU " + text + " is " + meaning + ", but [loop] cpu names none";
      found.remedy = "set [loop] cpu = " + std::to_string(apart.front());
      return found;
    }
    if (found.ok) {
      found.state = "CPU " + text + " " + meaning;
      return found;
    }
    found.state = which + (settings_.cpu ? " is not " : " is ") + meaning;
    found.remedy = boot_line();
    return found;
  }

  Finding throttling() const {
    Finding found{.name = "throttling", .ok = false, .state = {}, .remedy = {}};
    const std::string runtime = line_of(root_ + "/proc/sys/kernel/sched_rt_runtime_us");
    const std::string period = line_of(root_ + "/proc/sys/kernel/sched_rt_period_us");
    if (runtime.empty()) {
      found.ok = true;
      found.state = "this kernel has none";
    } else if (runtime == "-1") {
      found.ok = true;
      found.state = "off: nothing stops a loop that runs away";
    } else {
      const double part = 100.0 * std::strtod(runtime.c_str(), nullptr) /
                          std::max(std::strtod(period.c_str(), nullptr), 1.0);
      // A loop that sleeps every tick never gets near.
      found.ok = part >= 90.0;
      std::ostringstream text;
      text << "real-time threads may use " << part << " % of a CPU";
      found.state = text.str();
      if (!found.ok) found.remedy = "sudo sysctl -w kernel.sched_rt_runtime_us=950000";
    }
    return found;
  }

  Finding governor() const {
    Finding found{.name = "governor", .ok = true, .state = {}, .remedy = {}};
    std::size_t slow = 0;
    for (const int cpu : cpu_list(line_of(cpus_ / "online"))) {
      if (settings_.cpu && *settings_.cpu != cpu) continue;
      const std::string governor =
          line_of(cpus_ / ("cpu" + std::to_string(cpu)) / "cpufreq" / "scaling_governor");
      if (governor.empty()) continue;
      if (governor != "performance") ++slow;
      if (found.state.empty() || governor != "performance") found.state = governor;
    }
    if (found.state.empty()) found.state = "the CPU's frequency is not the kernel's to change";
    if (slow == 0) return found;
    found.ok = false;
    found.state = "\"" + found.state + "\": the CPU slows down between ticks";
    found.remedy = "sudo apt install linux-cpupower && sudo cpupower frequency-set -g performance";
    return found;
  }

  Finding clock_source() const {
    const fs::path folder = root_ + "/sys/devices/system/clocksource/clocksource0";
    const std::string current = line_of(folder / "current_clocksource");
    Finding found{.name = "clocksource", .ok = false, .state = current, .remedy = {}};
    // Read without entering the kernel.
    for (const char* quick : {"tsc", "kvm-clock", "arch_sys_counter", "hyperv_clocksource_tsc_page",
                              "timebase", "riscv_clocksource"})
      found.ok = found.ok || current == quick;
    if (found.ok) return found;
    if (current.empty())
      found.state = "not known";
    else
      found.state += ": every reading of the time is a system call";
    std::istringstream available{line_of(folder / "available_clocksource")};
    for (std::string each; available >> each;) {
      if (each != "tsc") continue;
      found.remedy =
          "echo tsc | sudo tee "
          "/sys/devices/system/clocksource/clocksource0/current_clocksource";
    }
    if (found.remedy.empty()) found.remedy = "add tsc=reliable to the kernel's command line";
    return found;
  }

  static Finding timers() {
    Finding found{.name = "timers", .ok = false, .state = {}, .remedy = {}};
    timespec resolution{};
    clock_getres(CLOCK_MONOTONIC, &resolution);
    found.ok = resolution.tv_sec == 0 && resolution.tv_nsec == 1;
    found.state = std::to_string(resolution.tv_nsec) + " ns resolution";
    if (!found.ok)
      found.remedy = "boot without highres=off, in a kernel with CONFIG_HIGH_RES_TIMERS";
    return found;
  }

 private:
  // For the CPU of the rig file, or the last one: interrupts go to the first by default.
  std::string boot_line() const {
    const std::vector<int> online = cpu_list(line_of(cpus_ / "online"));
    if (online.size() < 2) return "use a machine with two CPUs or more";
    const std::string cpu = std::to_string(settings_.cpu.value_or(online.back()));
    return "add isolcpus=managed_irq,domain," + cpu + " nohz_full=" + cpu + " rcu_nocbs=" + cpu +
           " to GRUB_CMDLINE_LINUX in /etc/default/grub, sudo update-grub, boot; [loop] cpu = " +
           cpu;
  }

  Settings settings_;
  fs::path cpus_;
  std::string root_;
};

}  // namespace

std::string realtime_kernel(const std::string& machine) {
  const char* const architecture = machine == "x86_64"    ? "amd64"
                                   : machine == "aarch64" ? "arm64"
                                                          : nullptr;
  if (architecture == nullptr) return "boot a kernel that is built with CONFIG_PREEMPT_RT";
  return std::string{"sudo apt install linux-image-rt-"} + architecture + ", then boot it";
}

std::vector<int> cpu_list(const std::string& text) {
  std::vector<int> cpus;
  std::istringstream parts{text};
  for (std::string part; std::getline(parts, part, ',');) {
    int first = 0;
    int last = 0;
    const int read = std::sscanf(part.c_str(), "%d-%d", &first, &last);
    if (read < 1) continue;
    if (read == 1) last = first;
    for (int cpu = first; cpu <= last; ++cpu) cpus.push_back(cpu);
  }
  return cpus;
}

std::vector<Finding> examine_machine(const Settings& settings, const std::string& root) {
  const Examination examination{settings, root};
  return {examination.kernel(),
          examination.apart("isolcpus", "isolated", "kept free of ordinary threads"),
          examination.apart("nohz_full", "nohz_full", "without a periodic tick"),
          examination.throttling(),
          examination.governor(),
          examination.clock_source(),
          Examination::timers()};
}

}  // namespace sinerig::realtime
