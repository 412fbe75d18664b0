// Marks what the loop may call: no allocation, no lock, no system call that can wait. Clang >= 20
// checks it at run time under the `rtsan` preset; other compilers ignore it.
#pragma once

#if defined(__has_feature)
#if __has_feature(realtime_sanitizer)
#define SINERIG_UNDER_RTSAN
#include <sanitizer/rtsan_interface.h>
#endif
#endif

#if defined(__has_cpp_attribute)
#if __has_cpp_attribute(clang::nonblocking)
#define SINERIG_NONBLOCKING [[clang::nonblocking]]
#endif
#endif
#ifndef SINERIG_NONBLOCKING
#define SINERIG_NONBLOCKING
#endif

namespace sinerig {

// Lives around a system call that a tick must make: its sleep, and what a driver exchanges with a
// descriptor that never makes it wait. The sanitizer, which goes by the call's name, looks away.
class SystemCall {
 public:
  SystemCall() noexcept { look_away(); }
  ~SystemCall() { look_again(); }
  SystemCall(const SystemCall&) = delete;
  SystemCall& operator=(const SystemCall&) = delete;

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

}  // namespace sinerig
