#include "no_allocation/counting_allocator.h"

#include <cerrno>
#include <cstdlib>
#include <new>

// glibc's own allocator, under the names that it keeps for replacements like this one.
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* pointer, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
}

namespace {

thread_local bool watched = false;
thread_local std::uint64_t allocations = 0;

void note() noexcept {
  if (watched) ++allocations;
}

void* checked(void* pointer) {
  if (pointer == nullptr) throw std::bad_alloc{};
  return pointer;
}

}  // namespace

namespace sinerig::test {

void watch_allocations() noexcept {
  allocations = 0;
  watched = true;
}

std::uint64_t stop_watching() noexcept {
  watched = false;
  return allocations;
}

}  // namespace sinerig::test

extern "C" {

void* malloc(std::size_t size) {
  note();
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  note();
  return __libc_calloc(count, size);
}
void* realloc(void* pointer, std::size_t size) {
  note();
  return __libc_realloc(pointer, size);
}
void* memalign(std::size_t alignment, std::size_t size) {
  note();
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  note();
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** pointer, std::size_t alignment, std::size_t size) {
  note();
  *pointer = __libc_memalign(alignment, size);
  return *pointer == nullptr ? ENOMEM : 0;
}

}  // extern "C"

void* operator new(std::size_t size) {
  note();
  return checked(__libc_malloc(size));
}
void* operator new[](std::size_t size) {
  note();
  return checked(__libc_malloc(size));
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  note();
  return checked(__libc_memalign(static_cast<std::size_t>(alignment), size));
}
void* operator new[](std::size_t size, std::align_val_t alignment) {
  note();
  return checked(__libc_memalign(static_cast<std::size_t>(alignment), size));
}
void operator delete(void* pointer) noexcept {
  std::free(pointer);
}
void operator delete[](void* pointer) noexcept {
  std::free(pointer);
}
void operator delete(void* pointer, std::size_t) noexcept {
  std::free(pointer);
}
void operator delete[](void* pointer, std::size_t) noexcept {
  std::free(pointer);
}
void operator delete(void* pointer, std::align_val_t) noexcept {
  std::free(pointer);
}
void operator delete[](void* pointer, std::align_val_t) noexcept {
  std::free(pointer);
}
void operator delete(void* pointer, std::size_t, std::align_val_t) noexcept {
  std::free(pointer);
}
void operator delete[](void* pointer, std::size_t, std::align_val_t) noexcept {
  std::free(pointer);
}
