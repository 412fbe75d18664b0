// For what a test double notes down while the loop is calling it: the real-time sanitizer looks
// away as long as one of these lives.
#pragma once

#include "sweep/nonblocking.h"

namespace sinerig::test {

using OutsideTheLoop = SystemCall;

}  // namespace sinerig::test
