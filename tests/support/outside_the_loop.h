// For what a test double notes down while the loop is calling it: the real-time sanitizer looks
// away as long as one of these lives.
#pragma once

#if defined(__has_feature)
#if __has_feature(realtime_sanitizer)
#define SINERIG_UNDER_RTSAN
#include <sanitizer/rtsan_interface.h>
#endif
#endif

namespace sinerig::test {

class OutsideTheLoop {
 public:
  OutsideTheLoop() noexcept { look_away(); }
  ~OutsideTheLoop() { look_again(); }
  OutsideTheLoop(const OutsideTheLoop&) = delete;
  OutsideTheLoop& operator=(const OutsideTheLoop&) = delete;

 private:
#ifdef SINERIG_UNDER_RTSAN
  static void look_away() noexcept {
    __rtsan_disable();
  }
  static void look_again() noexcept {
    __rtsan_enable();
  }
#else
  static void look_away() noexcept {}
  static void look_again() noexcept {}
#endif
};

}  // namespace sinerig::test
