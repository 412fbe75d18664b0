// Marks what the loop may call: no allocation, no lock, no system call that can wait. Clang >= 20
// checks it at run time under the `rtsan` preset; other compilers ignore it.
#pragma once

#if defined(__has_cpp_attribute)
#if __has_cpp_attribute(clang::nonblocking)
#define SINERIG_NONBLOCKING [[clang::nonblocking]]
#endif
#endif
#ifndef SINERIG_NONBLOCKING
#define SINERIG_NONBLOCKING
#endif
