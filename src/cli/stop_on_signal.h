// Signals that ask a run to stop.
#pragma once

#include <csignal>

#include "sweep/runner.h"

namespace sinerig::cli {

// SIGINT, SIGTERM and SIGHUP become stop requests for as long as this lives. Of several all have
// them: what asks a run to stop asks the night around it, too, even where the run has just ended. A
// reader of the output that goes away (SIGPIPE) is no reason to leave an actuator where it is.
class StopOnSignal {
 public:
  // What the one around it was asked before holds for `control`.
  explicit StopOnSignal(RunControl& control);
  ~StopOnSignal();
  StopOnSignal(const StopOnSignal&) = delete;
  StopOnSignal& operator=(const StopOnSignal&) = delete;

 private:
  static void count_stop_request(int signal);

  RunControl& control_;
  StopOnSignal* outer_;
  struct sigaction old_int_ {};
  struct sigaction old_term_ {};
  struct sigaction old_hup_ {};
  struct sigaction old_pipe_ {};
};

}  // namespace sinerig::cli
