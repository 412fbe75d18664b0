#include "realtime/process_rights.h"

#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <malloc.h>
#include <unistd.h>

#include <linux/capability.h>
#include <sys/mman.h>
#include <system_error>

namespace sinerig::realtime {

namespace {

constexpr std::size_t mebibyte = std::size_t{1} << 20U;

// More than a run takes after its loop has begun: SQLite's cache, messages, the live page.
constexpr std::size_t heap_reserve = 16 * mebibyte;

constexpr const char* latency_path = "/dev/cpu_dma_latency";

// Every page written to once, so that it is there when it is needed.
void touch(void* memory, std::size_t size) {
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  auto* const bytes = static_cast<volatile char*>(memory);
  for (std::size_t i = 0; i < size; i += page) bytes[i] = 1;
}

}  // namespace

ProcessRights::ProcessRights() {
  grants_.push_back(lock_memory());
  grants_.push_back(keep_heap());
  grants_.push_back(hold_latency());
}

ProcessRights::~ProcessRights() {
  if (latency_fd_ >= 0) close(latency_fd_);
  if (locked_) munlockall();
}

// Under a limit, what is taken later would no longer fit and fail: all or nothing.
Grant ProcessRights::lock_memory() {
  const rlim_t limit = raise_soft_limit(RLIMIT_MEMLOCK);
  Grant grant{.right = Right::memory, .state = {}, .remedy = {}};
  if (limit != RLIM_INFINITY && !has_capability(CAP_IPC_LOCK)) {
    grant.state = "cannot be locked: the limit of locked memory (RLIMIT_MEMLOCK) is " +
                  std::to_string(limit / 1024) + " KiB and must be unlimited";
    grant.remedy = allow_locked_memory(starter());
    return grant;
  }
  locked_ = mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
  grant.granted = locked_;
  if (locked_) {
    grant.state = "all of it locked, now and later";
  } else {
    grant.state = std::string{"cannot be locked: "} + std::strerror(errno);
    grant.remedy = errno == EPERM ? allow_locked_memory(starter())
                                  : "free some memory: everything the program maps must fit";
  }
  return grant;
}

Grant ProcessRights::keep_heap() {
  Grant grant{.right = Right::heap, .state = {}, .remedy = {}};
  grant.granted = mallopt(M_TRIM_THRESHOLD, -1) == 1 && mallopt(M_MMAP_MAX, 0) == 1 &&
                  mallopt(M_TOP_PAD, static_cast<int>(mebibyte)) == 1;
  if (!grant.granted) {
    grant.state = "the allocator of this build knows no mallopt()";
    grant.remedy = "use a build with glibc's allocator, without a sanitizer";
    return grant;
  }
  if (void* const reserve = std::malloc(heap_reserve); reserve != nullptr) {
    touch(reserve, heap_reserve);
    std::free(reserve);
  }
  grant.state = std::to_string(heap_reserve / mebibyte) + " MiB touched, never given back";
  return grant;
}

// The kernel keeps to the request for as long as the file is open.
Grant ProcessRights::hold_latency() {
  Grant grant{.right = Right::idle_states, .state = {}, .remedy = {}};
  latency_fd_ = open(latency_path, O_WRONLY | O_CLOEXEC);
  const std::int32_t longest_us = 0;
  grant.granted =
      latency_fd_ >= 0 && write(latency_fd_, &longest_us, sizeof longest_us) == sizeof longest_us;
  if (grant.granted) {
    grant.state = std::string{latency_path} + " held at 0 µs";
    return grant;
  }
  const int error = errno;
  std::error_code ignored;
  return without_latency_file(error, starter(),
                              std::filesystem::exists("/sys/devices/system/cpu/cpuidle", ignored));
}

Grant without_latency_file(int error, const Starter& starter, bool idles) {
  Grant grant{.right = Right::idle_states, .state = {}, .remedy = {}};
  if (error == ENOENT && !idles) {
    grant.granted = true;
    grant.state = "there are no idle states that this kernel could choose";
    return grant;
  }
  grant.state = std::string{latency_path} + " cannot be written: " + std::strerror(error);
  grant.remedy = error == ENOENT ? show_cpu_latency(starter) : allow_cpu_latency(starter);
  return grant;
}

}  // namespace sinerig::realtime
