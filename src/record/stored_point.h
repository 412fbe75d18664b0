// A point as it left the loop, in the form that readers of sweep files know it.
#pragma once

#include "record/sweep_reader.h"
#include "sweep/records.h"

namespace sinerig::record {

// What reading the written point back would give.
StoredPoint stored_point(const Point& point);

}  // namespace sinerig::record
