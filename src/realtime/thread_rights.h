// What the loop's thread needs for itself. All functions are for the thread that calls them.
#pragma once

#include "realtime/rights.h"

namespace sinerig::realtime {

// Asks for scheduling, CPU and timer slack, and touches the stack.
Grants enter(const Settings& settings);

// Back to the ordinary class, for what may wait for ordinary threads.
void leave() noexcept;

}  // namespace sinerig::realtime
