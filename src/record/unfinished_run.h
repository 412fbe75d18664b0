// A sweep file whose run did not end: how far it came, and what is needed to go on.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "record/sweep_reader.h"
#include "record/sweep_writer.h"
#include "sweep/runner.h"

namespace sinerig::record {

struct UnfinishedRun {
  StoredRun stored;
  FinishedDwells finished;
  PartStart start;  // of the part to come

  // The run ended by itself: there is nothing to resume.
  bool done() const { return stored.fact("outcome") == "done"; }
};

// False for what a run leaves that was killed before its plan was on the disk: an empty file, or a
// database with nothing in it. Throws SweepFileError for what cannot be read: nobody knows what is
// lost with that.
bool is_begun(const std::string& path);

// A dwell is finished when its timing is on record, which is written last, and the sweep did not
// end in it; the first that is not is where the run goes on. What a soft limit has given up is
// finished. Throws SweepFileError for what is no sweep file, and for one that this version would
// have laid out differently.
UnfinishedRun read_unfinished(const std::string& path);

// The dwells that refinement has added to the stored plan, as candidates of the plan. Throws
// SweepFileError naming the first stored dwell that the plan has not.
std::vector<std::uint32_t> candidates_refined(const std::string& path, const SweepPlan& stored,
                                              const SweepPlan& plan);

// Whether `sinerig resume` would go on with it; false for whatever cannot be read.
bool can_be_resumed(const std::string& path) noexcept;

}  // namespace sinerig::record
