// Preloaded into a program: its wall clock jumps by up to a day at every reading, and where
// $SINERIG_SUSPENDED_AT names a number of ticks, the machine sleeps for an hour after about that
// many (CLOCK_BOOTTIME goes on, CLOCK_MONOTONIC does not).
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <ctime>
#include <dlfcn.h>

#include <sys/time.h>

namespace {

using ReadClock = int (*)(clockid_t, timespec*);

int real_time(clockid_t clock, timespec* now) {
  static const auto real = reinterpret_cast<ReadClock>(dlsym(RTLD_NEXT, "clock_gettime"));
  return real(clock, now);
}

std::atomic<std::uint64_t> readings{0};

long jump_s() {
  const std::uint64_t mixed = (readings.fetch_add(1) + 1) * 0x9E3779B97F4A7C15U;
  return static_cast<long>(mixed >> 40U) % 86'400 - 43'200;
}

std::atomic<std::uint64_t> boot_readings{0};

long asleep_s() {
  static const char* const at = std::getenv("SINERIG_SUSPENDED_AT");
  if (at == nullptr) return 0;
  return boot_readings.fetch_add(1) >= std::strtoull(at, nullptr, 10) ? 3600 : 0;
}

}  // namespace

extern "C" {

int clock_gettime(clockid_t clock, timespec* now) noexcept {
  const int result = real_time(clock, now);
  if (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE) now->tv_sec += jump_s();
  if (clock == CLOCK_BOOTTIME) now->tv_sec += asleep_s();
  return result;
}

int gettimeofday(timeval* now, void* /*zone*/) noexcept {
  timespec exact{};
  clock_gettime(CLOCK_REALTIME, &exact);
  now->tv_sec = exact.tv_sec;
  now->tv_usec = exact.tv_nsec / 1000;
  return 0;
}

time_t time(time_t* out) noexcept {
  timespec exact{};
  clock_gettime(CLOCK_REALTIME, &exact);
  if (out != nullptr) *out = exact.tv_sec;
  return exact.tv_sec;
}

}  // extern "C"
