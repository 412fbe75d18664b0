// What a night has brought: each sweep, and what changed between its repeats.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "record/compare.h"

namespace sinerig::report {

struct NightRow {
  std::string name;  // of the sweep
  int repeat = 1;
  std::string file;
  std::string outcome;  // done, stopped, interrupted, failed, or "not run"
  std::string detail;
  std::size_t points = 0;
  std::size_t good = 0;
  std::size_t parts = 0;  // more than one where it was resumed
  double bench_s = 0.0;
  std::string started_utc;
  // Against the first repeat, response by response; empty for the first itself.
  std::vector<record::Difference> differences;

  bool changed() const;
};

void print_night(std::ostream& stream, const std::string& job, const std::vector<NightRow>& rows);

// {format, job, changed, sweeps: [{name, repeat, file, outcome, …, differences}]}.
nlohmann::ordered_json night_json(const std::string& job, const std::vector<NightRow>& rows);

}  // namespace sinerig::report
