// For what a test double notes down while the loop is calling it: the real-time sanitizer looks
// away as long as one of these lives.
#pragma once

#if defined(__has_feature)
#if __has_feature(realtime_sanitizer)
#define SINERIG_UNDER_RTSAN 1
#endif
#endif

#ifdef SINERIG_UNDER_RTSAN
#include <sanitizer/rtsan_interface.h>
#endif

namespace sinerig::test {

class OutsideTheLoop {
 public:
#ifdef SINERIG_UNDER_RTSAN
  OutsideTheLoop() noexcept {
    __rtsan_disable();
  }
  ~OutsideTheLoop() {
    __rtsan_enable();
  }
#else
  OutsideTheLoop() noexcept {}
  ~OutsideTheLoop() {}
#endif
  OutsideTheLoop(const OutsideTheLoop&) = delete;
  OutsideTheLoop& operator=(const OutsideTheLoop&) = delete;
};

}  // namespace sinerig::test
