// One thing to do about each right that was refused: it depends on who started the program.
#pragma once

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

// The path of this program.
std::string program_path();

// Whether the process holds a capability of <linux/capability.h>.
bool has_capability(int capability);

}  // namespace sinerig::realtime
