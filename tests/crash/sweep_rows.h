// What a sweep file holds of its finished dwells, row by row to the last bit.
#pragma once

#include <cstdint>
#include <set>
#include <string>

namespace sinerig::test {

struct SweepRows {
  bool begun = false;          // the plan is on the disk
  std::string integrity;       // "ok"
  std::string outcome;         // empty: none
  std::uint32_t finished = 0;  // dwells, from the first on
  std::uint32_t dwells = 0;    // known
  std::uint32_t parts = 0;
  std::uint32_t stopped = 0;     // points
  std::set<std::string> rows;    // of finished dwells: points, timing, blocks, lessons
  std::set<std::string> points;  // of finished dwells
};

// `before`: rows of the dwells in front of this one only. The file and what lies beside it stay as
// they are.
SweepRows rows_of(const std::string& path, std::uint32_t before = 0xffffffffU);

}  // namespace sinerig::test
