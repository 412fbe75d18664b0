// The events of a night against what was planted in it: each has its cause, each cause its event.
#pragma once

#include <map>
#include <utility>

#include "overnight_faults.h"
#include "record/sweep_reader.h"

namespace sinerig::bench {

struct Account {
  std::map<Ill, std::pair<int, int>> answered;  // planted, answered
  int unexplained = 0;                          // events
  int unanswered = 0;                           // planted ills and lost readings
};

// Prints what does not tally.
Account reconcile(const Night& night, const record::StoredRun& run);

}  // namespace sinerig::bench
