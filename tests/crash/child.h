// A run as a process that can be killed at any instant, and the points that it has told of.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

namespace sinerig::test {

struct ToldPoint {
  std::uint32_t dwell = 0;
  std::string output;
  double freq_hz = 0.0;
  double re = 0.0;
  double im = 0.0;
};

struct ChildEnd {
  int code = -1;  // exit code; −signal where it was killed
  double seconds = 0.0;
  std::vector<ToldPoint> points;  // of its --json, in whole lines
  std::string errors;
};

// Runs `program arguments…` in `folder` with SINERIG_FAULTY_DISK set where `orders` are given, and
// kills it with -9 after `kill_after` where it has not ended by itself.
ChildEnd run_child(const std::string& program, const std::vector<std::string>& arguments,
                   const std::string& folder, const std::string& orders,
                   std::optional<std::chrono::microseconds> kill_after);

}  // namespace sinerig::test
