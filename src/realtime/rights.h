// What a loop in real time asks of the machine, and what came of it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <sys/resource.h>

namespace sinerig::realtime {

// How the loop's thread is to run: [loop] priority and cpu of the rig file.
struct Settings {
  int priority = 80;         // of SCHED_FIFO, 1 to 99; threaded interrupts have 50
  std::optional<int> cpu{};  // the only one that it may run on; nothing: any
};

enum class Right : std::uint8_t {
  scheduling,   // SCHED_FIFO: nothing ordinary takes the CPU away
  cpu,          // its own CPU; asked for only where the settings name one
  memory,       // all of it locked: no page is ever fetched
  heap,         // touched beforehand, never given back
  idle_states,  // the CPU does not fall asleep so deeply that waking it takes long
  timer_slack,  // timers of an ordinary thread may fire 50 µs late, together with others
};

// "scheduling", "memory" …: in messages and, behind "realtime_", in the sweep file.
const char* to_string(Right right) noexcept;

struct Grant {
  Right right{};
  bool granted = false;
  std::string state;   // "SCHED_FIFO, priority 80", or what was refused and why
  std::string remedy;  // one thing to do; empty where it was granted
};

using Grants = std::vector<Grant>;

Grants missing(const Grants& grants);

// Whether cap_sys_nice and cap_ipc_lock would grant some of what is missing.
bool capabilities_would_help(const Grants& grants);

// "scheduling: SCHED_FIFO 80 was refused: …; REMEDY", one line for each that is missing.
std::string describe_missing(const Grants& grants, const std::string& indent);

// As far as it may be raised, the hard limit, which is ours to use: what it is then. `resource` is
// an RLIMIT_… of <sys/resource.h>.
rlim_t raise_soft_limit(int resource);

}  // namespace sinerig::realtime
