#include "realtime/thread_rights.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <sched.h>
#include <unistd.h>

#include <linux/capability.h>
#include <sys/prctl.h>
#include <system_error>

#include "realtime/remedies.h"

namespace sinerig::realtime {

namespace {

// The deepest call of a tick uses a few kilobytes.
constexpr std::size_t stack_reserve = std::size_t{256} << 10U;

[[gnu::noinline]] void touch_stack() {
  volatile char reserve[stack_reserve];
  for (std::size_t i = 0; i < sizeof reserve; i += 1024) reserve[i] = 1;
}

bool control_groups_have_budgets() {
  std::error_code ignored;
  return std::filesystem::exists("/sys/fs/cgroup/cpu/cpu.rt_runtime_us", ignored) ||
         std::filesystem::exists("/sys/fs/cgroup/cpu,cpuacct/cpu.rt_runtime_us", ignored);
}

Grant ask_for_priority(int priority) {
  Grant grant{.right = Right::scheduling, .state = {}, .remedy = {}};
  const rlim_t limit = raise_soft_limit(RLIMIT_RTPRIO);
  const sched_param wanted{.sched_priority = priority};
  grant.granted = sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &wanted) == 0;
  if (grant.granted) {
    grant.state = "SCHED_FIFO, priority " + std::to_string(priority);
    return grant;
  }
  grant.state = "SCHED_FIFO " + std::to_string(priority) + " was refused: " + std::strerror(errno);
  if (limit < static_cast<rlim_t>(priority) && !has_capability(CAP_SYS_NICE)) {
    grant.state += ": the limit of real-time priority (RLIMIT_RTPRIO) is " + std::to_string(limit);
    grant.remedy = allow_priority(starter());
  } else {
    const bool budgets = control_groups_have_budgets();
    grant.state += budgets ? ": its control group has no real-time budget"
                           : ": by a system call filter, or by the kernel's CONFIG_RT_GROUP_SCHED";
    grant.remedy = allow_class(starter(), budgets);
  }
  return grant;
}

std::string allowed_cpus() {
  cpu_set_t set;
  CPU_ZERO(&set);
  sched_getaffinity(0, sizeof set, &set);
  std::string text;
  for (std::size_t cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (!CPU_ISSET(cpu, &set)) continue;
    text += (text.empty() ? "" : ", ") + std::to_string(cpu);
  }
  return text;
}

Grant ask_for_cpu(int cpu) {
  Grant grant{.right = Right::cpu, .state = {}, .remedy = {}};
  const std::string allowed = allowed_cpus();
  cpu_set_t only;
  CPU_ZERO(&only);
  if (cpu >= 0 && cpu < CPU_SETSIZE) CPU_SET(static_cast<std::size_t>(cpu), &only);
  grant.granted = sched_setaffinity(0, sizeof only, &only) == 0;
  if (grant.granted) {
    grant.state = "CPU " + std::to_string(cpu) + " only";
  } else {
    grant.state = "CPU " + std::to_string(cpu) + " was refused: " + std::strerror(errno);
    grant.remedy = "set [loop] cpu to one that this process may use: " + allowed;
  }
  return grant;
}

Grant ask_for_timer_slack() {
  Grant grant{.right = Right::timer_slack, .state = {}, .remedy = {}};
  grant.granted = prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL) == 0;
  grant.state = grant.granted ? "1 ns" : std::string{"was refused: "} + std::strerror(errno);
  if (!grant.granted) grant.remedy = "allow prctl(PR_SET_TIMERSLACK) in the seccomp filter";
  return grant;
}

}  // namespace

Grants enter(const Settings& settings) {
  touch_stack();
  Grants grants{ask_for_priority(settings.priority)};
  if (settings.cpu) grants.push_back(ask_for_cpu(*settings.cpu));
  grants.push_back(ask_for_timer_slack());
  return grants;
}

Grant follow(const Settings& loop) {
  if (loop.priority > 1) return ask_for_priority(loop.priority - 1);
  return {.right = Right::scheduling,
          .state = "ordinary: no priority is below the loop's, 1",
          .remedy = "set [loop] priority to 2 or more"};
}

// The flag stays: without CAP_SYS_NICE nobody gets rid of it, and asking to is refused.
void leave() noexcept {
  const sched_param none{.sched_priority = 0};
  sched_setscheduler(0, SCHED_OTHER | SCHED_RESET_ON_FORK, &none);
}

}  // namespace sinerig::realtime
