// The table of a bus in real time: how late the loop wakes, how long the driver's calls take, how
// old what it sees is.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "drivers/driver.h"
#include "drivers/monotonic_time.h"
#include "realtime/loop_thread.h"
#include "realtime/thread_rights.h"
#include "sweep/clock.h"

namespace sinerig::bench {

// In life it has a processor of its own: here it goes before the loop, where there is the right.
inline constexpr int priority_of_a_device = 90;

class LatencyTable {
 public:
  LatencyTable(double rate_hz, double seconds)
      : rate_hz_{rate_hz}, ticks_{static_cast<std::uint64_t>(rate_hz * seconds)} {
    for (auto* values : {&lateness_ns_, &tick_ns_, &age_ns_}) values->reserve(ticks_);
  }

  // The loop on a thread with what rights there are: `write` takes the tick's index, `read` the
  // reading whose age counts.
  template <class Write, class Read>
  void run(Write write, Read read) {
    realtime::LoopThread thread{realtime::Settings{}};
    scheduling_ = thread.grants().front().state;
    thread.start([&] { loop(write, read); }, {});
    thread.join();
  }

  void print(const char* title) const {
    double load = 0.0;
    getloadavg(&load, 1);
    std::printf("%s; loop: %s; load average %.1f\n", title, scheduling_.c_str(), load);
    std::printf("%-28s %9s %9s %9s %9s %9s   µs\n", "", "50 %", "90 %", "99 %", "99.9 %", "most");
    print_quantiles("loop lateness", lateness_ns_);
    print_quantiles("driver's calls per tick", tick_ns_);
    print_quantiles("age of a sample in the loop", age_ns_);
    std::printf("%llu ticks, %llu skipped, %llu without a new sample\n",
                static_cast<unsigned long long>(ticks_), static_cast<unsigned long long>(skipped_),
                static_cast<unsigned long long>(missing_));
  }

 private:
  template <class Write, class Read>
  void loop(Write& write, Read& read) {
    MonotonicClock clock{TickGrid{rate_hz_}};
    std::uint64_t index = 0;
    while (index < ticks_) {
      const Tick tick = clock.wait();
      skipped_ += tick.index - index;
      index = tick.index + 1;
      const std::int64_t begin_ns = monotonic_now_ns();
      write(tick.index);
      const Sample sample = read();
      const std::int64_t end_ns = monotonic_now_ns();
      lateness_ns_.push_back(tick.lateness.count());
      tick_ns_.push_back(end_ns - begin_ns);
      if (sample.fault == Fault::none)
        age_ns_.push_back(end_ns - sample.time_ns);
      else
        ++missing_;
    }
  }

  static void print_quantiles(const char* what, std::vector<std::int64_t> values) {
    if (values.empty()) return;
    std::ranges::sort(values);
    const auto last = static_cast<double>(values.size() - 1);
    std::printf("%-28s", what);
    for (const double part : {0.5, 0.9, 0.99, 0.999, 1.0})
      std::printf(" %9.1f",
                  1e-3 * static_cast<double>(values[static_cast<std::size_t>(part * last)]));
    std::printf("\n");
  }

  double rate_hz_;
  std::uint64_t ticks_;
  std::string scheduling_;
  std::vector<std::int64_t> lateness_ns_;
  std::vector<std::int64_t> tick_ns_;
  std::vector<std::int64_t> age_ns_;
  std::uint64_t skipped_ = 0;
  std::uint64_t missing_ = 0;
};

// The Nth argument, a number above 0, else `fallback`.
inline double argument(int count, char** arguments, int n, double fallback) {
  const double given = count > n ? std::atof(arguments[n]) : fallback;
  return given > 0.0 ? given : fallback;
}

}  // namespace sinerig::bench
