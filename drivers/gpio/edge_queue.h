// Edges straight from the kernel's second GPIO interface (Linux 5.10): a queue of settable length
// for all lines of a request, with sequence numbers that show what was lost.
#pragma once

#include <memory>

#include "drivers/gpio/lines.h"

namespace sinerig::gpio {

// Throws as LineBank::edges().
std::unique_ptr<EdgeLines> open_edge_queue(const LineRequest& request);

}  // namespace sinerig::gpio
