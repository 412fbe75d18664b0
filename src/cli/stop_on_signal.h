// Signals that ask a run to stop.
#pragma once

#include <array>
#include <csignal>

#include "sweep/run_control.h"

namespace sinerig::cli {

// SIGINT, SIGTERM and SIGHUP become stop requests for as long as this lives, SIGQUIT two at once.
// Of several all have them: what asks a run to stop asks the night around it, too, even where the
// run has just ended. What was ignored before, by nohup or by a shell for its background, stays so;
// but for SIGTERM.
//
// Whatever else would end or freeze the program with a command standing is ignored: a reader of the
// output that goes away (SIGPIPE), a file that reaches its limit (SIGXFSZ: the write fails, as on a
// full disk), a terminal that wants to put it to sleep (SIGTSTP, SIGTTIN, SIGTTOU).
class StopOnSignal {
 public:
  // What the one around it was asked before holds for `control`.
  explicit StopOnSignal(RunControl& control);
  ~StopOnSignal();
  StopOnSignal(const StopOnSignal&) = delete;
  StopOnSignal& operator=(const StopOnSignal&) = delete;

 private:
  static constexpr std::array stopping{SIGINT, SIGQUIT, SIGHUP, SIGTERM};
  static constexpr std::array ignored{SIGPIPE, SIGXFSZ, SIGTSTP, SIGTTIN, SIGTTOU};

  static void count_stop_request(int signal);

  RunControl& control_;
  StopOnSignal* outer_;
  std::array<struct sigaction, stopping.size()> old_stopping_{};
  std::array<struct sigaction, ignored.size()> old_ignored_{};
};

}  // namespace sinerig::cli
