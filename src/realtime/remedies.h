// One thing to do about each right that was refused: it depends on who started the program.
#pragma once

#include <cstdint>
#include <string>

namespace sinerig::realtime {

struct Starter {
  enum class Kind { person, service, container };
  Kind kind = Kind::person;
  std::string name;  // of the user or of the unit
};

// From /proc/self/cgroup and the marks that containers leave.
Starter starter();

// With the starter given, for any machine.
std::string allow_priority(const Starter& starter);
std::string allow_locked_memory(const Starter& starter);
std::string allow_cpu_latency(const Starter& starter);
// Where limit or capability would do and SCHED_FIFO is refused all the same. `budgets`: the kernel
// divides the time of real-time threads among control groups (cgroup v1, cpu.rt_runtime_us).
std::string allow_class(const Starter& starter, bool budgets);
// Where /dev/cpu_dma_latency is not there.
std::string show_cpu_latency(const Starter& starter);

// The path of this program.
std::string program_path();

// Whether the process holds a capability of <linux/capability.h> that counts with the machine: root
// of a user namespace is nobody outside of it.
bool has_capability(int capability);

// From the text of a /proc/PID/uid_map: whether a user namespace is the machine's own, and who
// somebody in it is outside.
bool is_whole_machine(const std::string& uid_map);
std::uint32_t outside_id(const std::string& uid_map, std::uint32_t id);

}  // namespace sinerig::realtime
