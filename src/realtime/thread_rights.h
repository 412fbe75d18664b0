// What the loop's thread needs for itself. All functions are for the thread that calls them.
#pragma once

#include "realtime/rights.h"

namespace sinerig::realtime {

// Asks for scheduling, CPU and timer slack, and touches the stack.
Grants enter(const Settings& settings);

// For a thread that serves the loop, a driver's: nothing ordinary takes the CPU away from it
// either, and it never takes it from the loop. One priority below; nothing is asked for below the
// lowest.
Grant follow(const Settings& loop);

// Back to the ordinary class, for what may wait for ordinary threads.
void leave() noexcept;

}  // namespace sinerig::realtime
