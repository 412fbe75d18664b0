// A point as it left the loop, in the form that readers of sweep files know it.
#pragma once

#include "record/sweep_reader.h"
#include "sweep/records.h"

namespace sinerig::record {

// What reading the written point back would give, from a run at this rate.
StoredPoint stored_point(const Point& point, double rate_hz);

}  // namespace sinerig::record
