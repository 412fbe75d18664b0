// What the whole process needs before its loop may run: memory that stays, a CPU that stays awake.
#pragma once

#include "realtime/remedies.h"
#include "realtime/rights.h"

namespace sinerig::realtime {

// What it means that the file which keeps CPUs awake cannot be had, for `error` of opening it.
// `idles`: the kernel has idle states to keep them from (/sys/devices/system/cpu/cpuidle).
Grant without_latency_file(int error, const Starter& starter, bool idles);

// Asks for memory, heap and idle states; gives memory and idle states back at its end. Nothing of
// this can fail by an exception. One at a time.
class ProcessRights {
 public:
  ProcessRights();
  ~ProcessRights();
  ProcessRights(const ProcessRights&) = delete;
  ProcessRights& operator=(const ProcessRights&) = delete;

  const Grants& grants() const { return grants_; }

 private:
  Grant keep_heap();
  Grant lock_memory();
  Grant hold_latency();

  int latency_fd_ = -1;
  bool locked_ = false;
  Grants grants_;
};

}  // namespace sinerig::realtime
