// A run as it goes, for those who watch it. Fed on the recorder's thread, read on the server's; the
// loop knows nothing of either.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "dashboard/running_estimate.h"
#include "dashboard/scope.h"
#include "dashboard/watched_clock.h"
#include "dashboard/whereabouts.h"
#include "record/sweep_reader.h"
#include "report/remaining_time.h"
#include "sweep/runner.h"

namespace sinerig::dashboard {

using Text = std::shared_ptr<const std::string>;

// What is known before the first tick.
struct LiveSetup {
  std::string label;
  record::StoredRun run;  // facts, channels and plan; a StoredResponse without points per pair
  GuardSettings limits;
  bool in_real_time = true;
  bool preflight = false;  // the sweep begins with one
  // How often a stop was asked for, from wherever: 1 ramps down, 2 is neutral at once.
  std::function<int()> stop_requests{};
};

struct Ending {
  std::string outcome;  // done, interrupted, stopped
  std::string detail;
  std::vector<std::string> files;
};

class LiveRun {
 public:
  LiveRun(LiveSetup setup, const Lateness& lateness);
  ~LiveRun();

  // Before the first record: what an earlier, interrupted part of the run has left.
  void resume(const FinishedDwells& finished);
  // Recorder's thread: every record, in order.
  void take(const Record& record);
  // When all has been taken.
  void finish(Ending ending);

  // A name that no other run has: what a page knows is of this run or of another.
  const std::string& id() const { return id_; }
  // Server's thread. The page's data before the first point, fixed for the run.
  const Text& head() const { return head_; }
  // What has happened up to now, counted; a message holds the entries from `from` on, `next` is
  // where to go on. Null where there is nothing new.
  Text log(std::size_t from, std::size_t& next);
  // Where the run is now: dwell, times, lateness, headroom, estimates and traces.
  Text status();
  // How it ended; null while it goes on.
  Text ending();

 private:
  struct Moment;

  Moment moment();
  void begin_part();

  LiveSetup setup_;
  const Lateness& lateness_;
  std::string id_;
  Text head_;

  std::mutex mutex_;  // guards what is below
  std::vector<Record> entries_;
  std::size_t events_ = 0;
  Whereabouts where_;
  Scope scope_;
  std::vector<std::vector<RunningEstimate>> estimates_;  // per response, per tone of the dwell
  report::RemainingTime time_;
  std::unique_ptr<Ending> ending_;

  // Server's thread only: the last message made, which most watchers want.
  std::size_t cached_from_ = 0;
  std::size_t cached_next_ = 0;
  Text cached_;
};

}  // namespace sinerig::dashboard
