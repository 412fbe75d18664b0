// The live page of one run: what is shown, the server, and the clock that tells how late the loop
// is.
#pragma once

#include <optional>
#include <string>

#include "cli/run_teller.h"
#include "config/rig.h"
#include "dashboard/live_run.h"
#include "dashboard/server.h"
#include "dashboard/watched_clock.h"
#include "sweep/runner.h"

namespace sinerig::cli {

class LiveView {
 public:
  // Serves from here on. Throws std::invalid_argument for an address that is none,
  // std::runtime_error for one that cannot be had. `clock` and `control` must outlive it.
  LiveView(const std::string& address, const config::Rig& rig, const SweepPlan& plan, Clock& clock,
           RunControl& control);

  dashboard::LiveRun& run() { return run_; }
  // Where, the token in it.
  std::string url() const { return server_.url(); }
  // For the loop in place of its own.
  Clock& clock() { return clock_; }

  // How it ended, for those who still watch.
  void finish(const RunEnd& end);

 private:
  dashboard::Lateness lateness_;
  dashboard::WatchedClock clock_;
  dashboard::LiveRun run_;
  dashboard::Server server_;
};

}  // namespace sinerig::cli
