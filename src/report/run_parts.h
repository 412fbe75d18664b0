// The parts of a run that was interrupted, and how its disk kept up, in words.
#pragma once

#include <string>
#include <vector>

#include "record/sweep_reader.h"

namespace sinerig::report {

// "2026-03-01T22:14:05Z, from dwell 13: interrupted, stop requested …", one per part; none for a
// run in one piece.
std::vector<std::string> part_texts(const record::StoredRun& run);

// "every point was on the disk 0.012 s after its dwell at most", and how many later than the dwell
// behind it; empty where that was not measured.
std::string disk_text(const record::StoredRun& run);

}  // namespace sinerig::report
