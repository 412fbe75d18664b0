#include "realtime/remedies.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <pwd.h>
#include <sstream>
#include <unistd.h>

#include <linux/capability.h>
#include <sys/syscall.h>

namespace sinerig::realtime {

namespace {

namespace fs = std::filesystem;

// "0::/system.slice/sinerig@gimbal.service" → "sinerig@gimbal.service"; empty for others.
std::string unit_of_this_process() {
  std::ifstream file{"/proc/self/cgroup"};
  for (std::string line; std::getline(file, line);) {
    const std::size_t slice = line.find("/system.slice/");
    if (slice == std::string::npos || !line.ends_with(".service")) continue;
    return line.substr(line.rfind('/') + 1);
  }
  return {};
}

std::string uid_map() {
  std::ifstream file{"/proc/self/uid_map"};
  return {std::istreambuf_iterator<char>{file}, {}};
}

std::string user_name() {
  const uid_t user = outside_id(uid_map(), geteuid());
  const passwd* entry = getpwuid(user);
  return entry == nullptr ? std::to_string(user) : entry->pw_name;
}

std::string limit(const Starter& starter, const char* item, const char* value) {
  return "echo '" + starter.name + " - " + item + ' ' + value +
         "' | sudo tee -a /etc/security/limits.d/90-sinerig.conf, then log in again";
}

std::string unit_line(const Starter& starter, const char* line) {
  return "sudo systemctl edit " + starter.name + ": under [Service] " + line;
}

}  // namespace

Starter starter() {
  if (fs::exists("/.dockerenv") || fs::exists("/run/.containerenv"))
    return {.kind = Starter::Kind::container, .name = user_name()};
  const std::string unit = unit_of_this_process();
  if (!unit.empty()) return {.kind = Starter::Kind::service, .name = unit};
  return {.kind = Starter::Kind::person, .name = user_name()};
}

std::string allow_priority(const Starter& starter) {
  switch (starter.kind) {
    case Starter::Kind::service: return unit_line(starter, "LimitRTPRIO=99");
    case Starter::Kind::container:
      return "start the container with --cap-add SYS_NICE --ulimit rtprio=99";
    case Starter::Kind::person: return limit(starter, "rtprio", "99");
  }
  return {};
}

std::string allow_locked_memory(const Starter& starter) {
  switch (starter.kind) {
    case Starter::Kind::service: return unit_line(starter, "LimitMEMLOCK=infinity");
    case Starter::Kind::container:
      return "start the container with --cap-add IPC_LOCK --ulimit memlock=-1";
    case Starter::Kind::person: return limit(starter, "memlock", "unlimited");
  }
  return {};
}

std::string allow_cpu_latency(const Starter& starter) {
  switch (starter.kind) {
    case Starter::Kind::service:
      return unit_line(starter, "ExecStartPre=+/bin/chmod 0666 /dev/cpu_dma_latency");
    case Starter::Kind::container: return "start the container with --device /dev/cpu_dma_latency";
    case Starter::Kind::person:
      return "echo 'KERNEL==\"cpu_dma_latency\", OWNER=\"" + starter.name +
             "\"' | sudo tee /etc/udev/rules.d/90-sinerig.rules, then sudo udevadm trigger "
             "/dev/cpu_dma_latency";
  }
  return {};
}

std::string allow_class(const Starter& starter, bool budgets) {
  if (budgets) return "sudo sysctl -w kernel.sched_rt_runtime_us=-1";
  switch (starter.kind) {
    case Starter::Kind::service: return unit_line(starter, "RestrictRealtime=no");
    case Starter::Kind::container:
      return "start the container with --cap-add SYS_NICE and a seccomp profile that has "
             "sched_setscheduler";
    case Starter::Kind::person: return "boot a kernel without CONFIG_RT_GROUP_SCHED";
  }
  return {};
}

std::string show_cpu_latency(const Starter& starter) {
  switch (starter.kind) {
    case Starter::Kind::service: return unit_line(starter, "PrivateDevices=no");
    case Starter::Kind::container: return allow_cpu_latency(starter);
    case Starter::Kind::person: return "use a kernel with CONFIG_CPU_IDLE";
  }
  return {};
}

std::string program_path() {
  std::error_code ignored;
  const fs::path path = fs::read_symlink("/proc/self/exe", ignored);
  return path.empty() ? "sinerig" : path.string();
}

// Lines of "inside outside count".
bool is_whole_machine(const std::string& uid_map) {
  std::istringstream lines{uid_map};
  std::uint64_t inside = 1;
  std::uint64_t outside = 1;
  std::uint64_t count = 0;
  return lines >> inside >> outside >> count && inside == 0 && outside == 0 && count == UINT32_MAX;
}

std::uint32_t outside_id(const std::string& uid_map, std::uint32_t id) {
  std::istringstream lines{uid_map};
  std::uint64_t inside = 0;
  std::uint64_t outside = 0;
  std::uint64_t count = 0;
  while (lines >> inside >> outside >> count) {
    if (id >= inside && id - inside < count)
      return static_cast<std::uint32_t>(outside + id - inside);
  }
  return id;
}

bool has_capability(int capability) {
  if (!is_whole_machine(uid_map())) return false;
  __user_cap_header_struct header{.version = _LINUX_CAPABILITY_VERSION_3, .pid = 0};
  __user_cap_data_struct data[_LINUX_CAPABILITY_U32S_3] = {};
  if (syscall(SYS_capget, &header, data) != 0) return false;
  const auto index = static_cast<std::size_t>(CAP_TO_INDEX(capability));
  return (data[index].effective & CAP_TO_MASK(capability)) != 0;
}

}  // namespace sinerig::realtime
