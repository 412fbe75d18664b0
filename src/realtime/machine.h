// What of a machine decides how punctual a loop can be, beyond the rights of a process: each found
// in order or not, with one thing to do about it.
#pragma once

#include <string>
#include <vector>

#include "realtime/rights.h"

namespace sinerig::realtime {

struct Finding {
  std::string name;  // "kernel", "throttling" …
  bool ok = false;
  std::string state;
  std::string remedy;  // empty where it is in order
};

// Kernel, isolated and tickless CPUs, throttling, frequency governor, clock source, timers. Reads
// the files of /proc and /sys under `root`; what is not there is said so.
std::vector<Finding> examine_machine(const Settings& settings, const std::string& root = "");

// How to get a kernel with PREEMPT_RT for the `machine` of uname(2).
std::string realtime_kernel(const std::string& machine);

// "0-2,5" → 0, 1, 2, 5; what is no number is left out.
std::vector<int> cpu_list(const std::string& text);

}  // namespace sinerig::realtime
