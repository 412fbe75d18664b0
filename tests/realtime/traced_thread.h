// Every system call that a thread makes between two marks, counted by ptrace: what the kernel saw,
// not what the source says.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>

namespace sinerig::test {

struct Traced {
  std::map<std::string, std::uint64_t> calls;  // by name, "nr 39" for those without one here
  int exit_code = -1;                          // of `body`; −1: it did not end by itself
};

// Runs `body` in a forked process and traces the thread that calls it; other threads of its go
// unseen. Call from a process with one thread. Throws std::runtime_error where ptrace is not to be
// had.
Traced trace(const std::function<int()>& body);

// In `body`: the first mark begins the count, the second ends it.
void mark() noexcept;

}  // namespace sinerig::test
