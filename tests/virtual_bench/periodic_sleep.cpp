// Sleeps to absolute deadlines 1 ms apart and prints when it woke up, to the nanosecond.
#include <cinttypes>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>

namespace {

std::int64_t now_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

}  // namespace

int main(int count, char** arguments) {
  const long cycles = count > 1 ? std::strtol(arguments[1], nullptr, 10) : 1000;
  std::int64_t deadline_ns = now_ns();
  std::int64_t latest_ns = 0;
  for (long cycle = 0; cycle < cycles; ++cycle) {
    deadline_ns += 1'000'000;
    const timespec deadline{deadline_ns / 1'000'000'000, deadline_ns % 1'000'000'000};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, nullptr);
    const std::int64_t late_ns = now_ns() - deadline_ns;
    if (late_ns > latest_ns) latest_ns = late_ns;
    std::printf("%" PRId64 "\n", deadline_ns + late_ns);
  }
  std::printf("latest %" PRId64 "\n", latest_ns);
}
