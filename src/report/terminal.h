// What people read on a terminal: the plan, the points, the progress of a run.
#pragma once

#include <iosfwd>
#include <string>

#include "record/sweep_reader.h"
#include "sweep/plan.h"

namespace sinerig::report {

// Dwells with frequency asked and exact, amplitude, peak velocity and acceleration, settling,
// blocks and seconds; then the total. `unit` is the command's.
void print_plan(std::ostream& stream, const SweepPlan& plan, const SweepSettings& sweep,
                const std::string& unit);

// How the run went, and a table of points per response.
void print_run(std::ostream& stream, const record::StoredRun& run);

// Tones of all dwells: each becomes a point of every response.
std::size_t point_count(const SweepPlan& plan);

// "60 points in 15 dwells".
std::string plan_size_text(const SweepPlan& plan);

// "7:34 (454.5 s)", or the least and the most where the plan leaves it open.
std::string bench_time_text(const SweepPlan& plan);

// "3 page faults (1 from a disk), 2 involuntary switches", of the loop's thread.
std::string usage_text(const ThreadUsage& usage);

// 93784 s → "26:03:04", 12.3 s → "0:12".
std::string duration_text(double seconds);

}  // namespace sinerig::report
