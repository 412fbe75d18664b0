#include "cli/wall_time.h"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <thread>

namespace sinerig::cli {

namespace {

// As often as a run tells how it goes.
constexpr std::chrono::milliseconds look_interval{50};

template <class NotYet>
bool wait_while(NotYet not_yet, const std::atomic<int>& stop_requests,
                const WallTime::Meanwhile& meanwhile) {
  while (stop_requests.load() == 0 && not_yet()) {
    meanwhile();
    std::this_thread::sleep_for(look_interval);
  }
  return stop_requests.load() == 0;
}

std::string formatted(const std::tm& parts, const char* format) {
  char text[40];
  std::strftime(text, sizeof text, format, &parts);
  return text;
}

}  // namespace

std::int64_t SystemTime::now_s() {
  return std::time(nullptr);
}

double SystemTime::elapsed_s() {
  std::timespec time{};
  clock_gettime(CLOCK_BOOTTIME, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

bool SystemTime::wait_until(std::int64_t time_s, const std::atomic<int>& stop_requests,
                            const Meanwhile& meanwhile) {
  return wait_while([&] { return now_s() < time_s; }, stop_requests, meanwhile);
}

bool SystemTime::wait_for(double seconds, const std::atomic<int>& stop_requests,
                          const Meanwhile& meanwhile) {
  const double until_s = elapsed_s() + seconds;
  return wait_while([&] { return elapsed_s() < until_s; }, stop_requests, meanwhile);
}

bool PassingTime::wait_until(std::int64_t time_s, const std::atomic<int>& stop_requests,
                             const Meanwhile& meanwhile) {
  return wait_for(static_cast<double>(time_s - now_s()), stop_requests, meanwhile);
}

bool PassingTime::wait_for(double seconds, const std::atomic<int>& stop_requests,
                           const Meanwhile& meanwhile) {
  meanwhile();
  elapsed_s_ += std::max(0.0, seconds);
  return stop_requests.load() == 0;
}

std::int64_t next_time_of_day(std::int64_t from_s, int second_of_day) {
  const std::time_t from = from_s;
  std::tm parts{};
  localtime_r(&from, &parts);
  const auto on_day = [&](int days) {
    std::tm then = parts;
    then.tm_mday += days;
    then.tm_hour = second_of_day / 3600;
    then.tm_min = second_of_day / 60 % 60;
    then.tm_sec = second_of_day % 60;
    then.tm_isdst = -1;  // whatever the rules say of that day
    return static_cast<std::int64_t>(std::mktime(&then));
  };
  const std::int64_t today = on_day(0);
  return today >= from_s ? today : on_day(1);
}

std::string utc_text(std::int64_t time_s) {
  const std::time_t time = time_s;
  std::tm parts{};
  gmtime_r(&time, &parts);
  return formatted(parts, "%Y-%m-%dT%H:%M:%SZ");
}

std::string local_time_text(std::int64_t time_s) {
  const std::time_t time = time_s;
  std::tm parts{};
  localtime_r(&time, &parts);
  return formatted(parts, "%H:%M:%S");
}

}  // namespace sinerig::cli
