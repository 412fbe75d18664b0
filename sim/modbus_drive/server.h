// A simulated drive at work: answers every request at the true time of its last byte, early, late,
// wrongly or not at all, as the faults say.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "sim/modbus_drive/drive.h"
#include "sim/modbus_drive/line.h"

namespace sinerig::sim {

class DriveServer {
 public:
  explicit DriveServer(DriveSettings settings);

  std::string address() const { return line_->address(); }

  // When it has been switched on and off or has tripped, a line for each: "on at 0.512300 s,
  // set-point 0".
  std::string account() const;

  // Until `stop` or for `seconds`. A stop is noticed within `patience_s`.
  void run(const std::atomic<bool>& stop, double seconds, double patience_s = 1.0);

 private:
  struct Reply {
    std::int64_t due_ns = 0;
    Frame frame;
    bool spoiled = false;
  };

  void serve(const Frame& request, std::int64_t received_ns);
  void send_due(std::int64_t now_ns);
  void cause_faults(std::int64_t now_ns);
  std::int64_t next_due_ns() const;
  bool past(double at_s, std::int64_t now_ns) const;
  bool chance(double fraction);

  static constexpr std::int64_t boot_ns = 500'000'000;

  DriveSettings settings_;
  std::unique_ptr<Line> line_;
  std::int64_t start_ns_;
  Drive drive_;
  std::mt19937_64 random_;
  std::vector<Reply> replies_;
  std::int64_t booted_ns_ = 0;
  bool dropped_ = false;
  bool cycled_ = false;
  bool booting_ = false;
  bool tripped_ = false;
};

}  // namespace sinerig::sim
