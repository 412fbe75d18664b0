// Signals that ask a run to stop.
#pragma once

#include <csignal>

#include "sweep/runner.h"

namespace sinerig::cli {

// SIGINT, SIGTERM and SIGHUP become stop requests for as long as this lives; of several the
// innermost has them. A
// reader of the output that goes away (SIGPIPE) is no reason to leave an actuator where it is.
class StopOnSignal {
 public:
  explicit StopOnSignal(RunControl& control);
  ~StopOnSignal();
  StopOnSignal(const StopOnSignal&) = delete;
  StopOnSignal& operator=(const StopOnSignal&) = delete;

 private:
  RunControl* outer_ = nullptr;
  struct sigaction old_int_ {};
  struct sigaction old_term_ {};
  struct sigaction old_hup_ {};
  struct sigaction old_pipe_ {};
};

}  // namespace sinerig::cli
