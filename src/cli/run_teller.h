// What `sinerig run` says: to people, to a script, or nothing.
#pragma once

#include <cstdint>
#include <string>

#include "cli/commands.h"
#include "config/rig.h"
#include "report/progress.h"

namespace sinerig::cli {

struct RunEnd {
  std::string outcome;        // done, interrupted, stopped
  std::string reason;         // in words; empty when done
  std::string sweep_file;     // empty: it ended before it began
  std::string report_file{};  // empty: none
  std::uint64_t dropped_samples = 0;
};

class RunTeller {
 public:
  // `rig` and `plan` must outlive it.
  // With `table` the points are printed once more at the end.
  RunTeller(Voice voice, bool table, const config::Rig& rig, const SweepPlan& plan);

  // What will be run; `live_page` is where it can be watched, empty where it can't.
  void plan(const std::string& live_page);
  // Points of before an interruption, told already.
  void resume(const std::vector<Point>& points);
  void point(const Point& point);
  void update(std::uint32_t dwell, std::uint64_t tick);
  // The loop has ended.
  void close();
  // The files are written.
  void end(const RunEnd& end);

 private:
  void end_in_words(const RunEnd& end);
  void end_as_json(const RunEnd& end);

  Voice voice_;
  bool table_;
  const config::Rig& rig_;
  const SweepPlan& plan_;
  report::Progress progress_;
};

}  // namespace sinerig::cli
