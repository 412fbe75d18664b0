// Replaces operator new, malloc, calloc, realloc and their aligned kin for the whole binary, and
// counts the calls of the present thread while it is watched.
#pragma once

#include <cstdint>

namespace sinerig::test {

void watch_allocations() noexcept;  // from zero, on this thread
std::uint64_t stop_watching() noexcept;

}  // namespace sinerig::test
