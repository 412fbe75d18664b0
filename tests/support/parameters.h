// Seeds and counts of the random tests. SINERIG_TEST_SEED and SINERIG_TEST_COUNT replace the
// defaults: SINERIG_TEST_COUNT=100000 ctest -R Random
#pragma once

#include <cstdint>
#include <cstdlib>
#include <string>

namespace sinerig::test {

inline std::uint64_t parameter(const char* name, std::uint64_t fallback) {
  const char* text = std::getenv(name);
  return text == nullptr ? fallback : std::stoull(text);
}

inline std::uint64_t seed(std::uint64_t fallback) {
  return parameter("SINERIG_TEST_SEED", fallback);
}

inline std::uint64_t count(std::uint64_t fallback) {
  return parameter("SINERIG_TEST_COUNT", fallback);
}

}  // namespace sinerig::test
