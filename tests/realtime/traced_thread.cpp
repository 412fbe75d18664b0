#include "realtime/traced_thread.h"

#include <cerrno>
#include <csignal>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <unistd.h>

#include <sys/ptrace.h>
#include <sys/syscall.h>
#include <sys/user.h>
#include <sys/wait.h>

namespace sinerig::test {

namespace {

constexpr long mark_number = SYS_getppid;

std::string name_of(long number) {
  switch (number) {
    case SYS_clock_nanosleep: return "clock_nanosleep";
    case SYS_clock_gettime: return "clock_gettime";
    case SYS_getrusage: return "getrusage";
    case SYS_write: return "write";
    case SYS_read: return "read";
    case SYS_ioctl: return "ioctl";
    case SYS_sendto: return "sendto";
    case SYS_recvmsg: return "recvmsg";
    case SYS_getpid: return "getpid";
    case SYS_futex: return "futex";
    case SYS_mmap: return "mmap";
    case SYS_sched_yield: return "sched_yield";
    default: return "nr " + std::to_string(number);
  }
}

// At a stop on entry into a call. User-Mode Linux knows the registers only.
long number_at_entry(pid_t child) {
#if defined(__x86_64__)
  errno = 0;
  return ptrace(PTRACE_PEEKUSER, child, offsetof(user, regs.orig_rax), nullptr);
#else
  __ptrace_syscall_info info{};
  ptrace(PTRACE_GET_SYSCALL_INFO, child, sizeof info, &info);
  return static_cast<long>(info.entry.nr);
#endif
}

[[noreturn]] void fail(pid_t child, const char* what) {
  const std::string why = std::strerror(errno);
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  throw std::runtime_error(std::string{what} + ": " + why);
}

// The child is not to go on with the parent's tests.
int exit_code_of(const std::function<int()>& body) {
  try {
    return body();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "in the traced process: %s\n", error.what());
    return 125;
  }
}

int wait_for(pid_t child) {
  int status = 0;
  while (waitpid(child, &status, __WALL) < 0 && errno == EINTR) {
  }
  return status;
}

}  // namespace

void mark() noexcept {
  syscall(mark_number);
}

Traced trace(const std::function<int()>& body) {
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("fork failed");
  if (child == 0) {
    if (ptrace(PTRACE_TRACEME, 0, nullptr, nullptr) != 0) std::_Exit(126);
    raise(SIGSTOP);
    std::_Exit(exit_code_of(body));
  }
  int status = wait_for(child);
  if (!WIFSTOPPED(status)) fail(child, "the child cannot be traced");
  if (ptrace(PTRACE_SETOPTIONS, child, nullptr, PTRACE_O_TRACESYSGOOD | PTRACE_O_EXITKILL) != 0)
    fail(child, "ptrace options");

  Traced traced;
  constexpr int syscall_stop = SIGTRAP | 0x80;
  bool inside = false;  // a call has been entered and not yet left
  int marks = 0;
  int signal = 0;
  while (true) {
    if (ptrace(PTRACE_SYSCALL, child, nullptr, signal) != 0) fail(child, "ptrace");
    status = wait_for(child);
    if (!WIFSTOPPED(status)) break;
    signal = WSTOPSIG(status);
    if (signal != syscall_stop) continue;
    signal = 0;
    inside = !inside;
    if (!inside) continue;
    const long number = number_at_entry(child);
    if (number == mark_number) ++marks;
    if (marks == 1 && number != mark_number) ++traced.calls[name_of(number)];
  }
  if (WIFEXITED(status)) traced.exit_code = WEXITSTATUS(status);
  return traced;
}

}  // namespace sinerig::test
