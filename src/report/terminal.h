// What people read on a terminal: the plan, the points, the progress of a run.
#pragma once

#include <chrono>
#include <iosfwd>
#include <string>

#include "record/sweep_reader.h"
#include "sweep/plan.h"
#include "sweep/records.h"

namespace sinerig::report {

// Dwells with frequency asked and exact, amplitude, peak velocity and acceleration, settling,
// blocks and seconds; then the total. `unit` is the command's.
void print_plan(std::ostream& stream, const SweepPlan& plan, const SweepSettings& sweep,
                const std::string& unit);

// How the run went, and a table of points per response.
void print_run(std::ostream& stream, const record::StoredRun& run);

// "7:34 (454.5 s)", or the least and the most where the plan leaves it open.
std::string plan_size_text(const SweepPlan& plan);  // "60 points in 15 dwells"
std::string bench_time_text(const SweepPlan& plan);

// 93784 s → "26:03:04", 12.3 s → "0:12".
std::string duration_text(double seconds);

// Progress of a run: one line that is rewritten on a terminal, a line per point elsewhere.
class Progress {
 public:
  Progress(std::ostream& stream, bool terminal, const SweepPlan& plan);

  // A finished point; those of the first response are shown.
  void point(const Point& point);

  // Where the loop is.
  void update(std::uint32_t dwell);

  void close();

 private:
  std::ostream& stream_;
  bool terminal_;
  const SweepPlan& plan_;
  std::chrono::steady_clock::time_point start_;
  std::string last_point_;
};

}  // namespace sinerig::report
