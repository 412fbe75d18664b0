// The time of day that a night is planned by: of the system, or one that passes at once.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>

namespace sinerig::cli {

class WallTime {
 public:
  virtual ~WallTime() = default;

  // Seconds since 1970, UTC.
  virtual std::int64_t now_s() = 0;

  // False where `stop_requests` rose before. `meanwhile` is called now and then.
  virtual bool wait_until(std::int64_t time_s, const std::atomic<int>& stop_requests,
                          const std::function<void()>& meanwhile) = 0;

  // A sweep has taken this much bench time.
  virtual void pass(double seconds) = 0;
};

// Steps of the clock and a machine that slept are seen at once.
class SystemTime final : public WallTime {
 public:
  std::int64_t now_s() override;
  bool wait_until(std::int64_t time_s, const std::atomic<int>& stop_requests,
                  const std::function<void()>& meanwhile) override;
  void pass(double) override {}
};

// For rigs that run in virtual time: nobody waits for half past ten in a simulation.
class PassingTime final : public WallTime {
 public:
  explicit PassingTime(std::int64_t start_s) : now_s_{start_s} {}
  std::int64_t now_s() override { return now_s_; }
  bool wait_until(std::int64_t time_s, const std::atomic<int>& stop_requests,
                  const std::function<void()>& meanwhile) override;
  void pass(double seconds) override { now_s_ += static_cast<std::int64_t>(seconds); }

 private:
  std::int64_t now_s_;
};

// The first time at or after `from_s` at which the local time of day is `second_of_day`.
std::int64_t next_time_of_day(std::int64_t from_s, int second_of_day);

std::string utc_text(std::int64_t time_s);         // 2026-03-01T22:14:05Z
std::string local_time_text(std::int64_t time_s);  // 22:14:05

}  // namespace sinerig::cli
