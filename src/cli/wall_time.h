// The times that a night is planned by, of day and since it began: of the system, or ones that pass
// at once.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>

namespace sinerig::cli {

class WallTime {
 public:
  // Called now and then while it is waited.
  using Meanwhile = std::function<void()>;

  virtual ~WallTime() = default;

  // Seconds since 1970, UTC.
  virtual std::int64_t now_s() = 0;

  // Seconds since a moment that stays the same for as long as the machine runs, awake or not: no
  // step of the clock changes them.
  virtual double elapsed_s() = 0;

  // Until now_s() is that. False where `stop_requests` rose before.
  virtual bool wait_until(std::int64_t time_s, const std::atomic<int>& stop_requests,
                          const Meanwhile& meanwhile) = 0;

  // Until elapsed_s() has grown by that. The same.
  virtual bool wait_for(double seconds, const std::atomic<int>& stop_requests,
                        const Meanwhile& meanwhile) = 0;

  // A sweep has taken this much bench time.
  virtual void pass(double seconds) = 0;
};

// A machine that slept is seen at once, and by the time of day a step of the clock.
class SystemTime final : public WallTime {
 public:
  std::int64_t now_s() override;
  double elapsed_s() override;
  bool wait_until(std::int64_t time_s, const std::atomic<int>& stop_requests,
                  const Meanwhile& meanwhile) override;
  bool wait_for(double seconds, const std::atomic<int>& stop_requests,
                const Meanwhile& meanwhile) override;
  void pass(double) override {}
};

// For rigs that run in virtual time: nobody waits for half past ten in a simulation.
class PassingTime final : public WallTime {
 public:
  explicit PassingTime(std::int64_t start_s) : start_s_{start_s} {}
  std::int64_t now_s() override { return start_s_ + static_cast<std::int64_t>(elapsed_s_); }
  double elapsed_s() override { return elapsed_s_; }
  bool wait_until(std::int64_t time_s, const std::atomic<int>& stop_requests,
                  const Meanwhile& meanwhile) override;
  bool wait_for(double seconds, const std::atomic<int>& stop_requests,
                const Meanwhile& meanwhile) override;
  void pass(double seconds) override { elapsed_s_ += seconds; }

 private:
  std::int64_t start_s_;
  double elapsed_s_ = 0.0;
};

// The first time at or after `from_s` at which the local time of day is `second_of_day`.
std::int64_t next_time_of_day(std::int64_t from_s, int second_of_day);

std::string utc_text(std::int64_t time_s);         // 2026-03-01T22:14:05Z
std::string local_time_text(std::int64_t time_s);  // 22:14:05

}  // namespace sinerig::cli
