// The thread of the loop has what its grants say, and says what it has not.
#include "realtime/loop_thread.h"

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <sched.h>
#include <set>
#include <string>
#include <unistd.h>

#include <gmock/gmock.h>
#include <linux/capability.h>
#include <sys/prctl.h>
#include <sys/resource.h>

#include "realtime/process_rights.h"
#include "realtime/remedies.h"
#include "realtime/thread_rights.h"

namespace sinerig::realtime {
namespace {

using testing::HasSubstr;

std::uint64_t locked_kib() {
  std::ifstream status{"/proc/self/status"};
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("VmLck:")) return std::stoull(line.substr(6));
  return 0;
}

const Grant& grant_of(const Grants& grants, Right right) {
  for (const Grant& grant : grants)
    if (grant.right == right) return grant;
  throw std::runtime_error{std::string{"nothing was said of "} + to_string(right)};
}

int some_cpu() {
  cpu_set_t set;
  CPU_ZERO(&set);
  sched_getaffinity(0, sizeof set, &set);
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu)
    if (CPU_ISSET(static_cast<std::size_t>(cpu), &set)) return cpu;
  return 0;
}

struct Seen {
  int policy = -1;
  sched_param parameters{};
  int cpus = 0;
  int slack_ns = 0;
  sigset_t blocked{};
  pid_t thread = 0;
};

Seen look() {
  Seen seen;
  seen.policy = sched_getscheduler(0);
  sched_getparam(0, &seen.parameters);
  cpu_set_t set;
  CPU_ZERO(&set);
  sched_getaffinity(0, sizeof set, &set);
  seen.cpus = CPU_COUNT(&set);
  seen.slack_ns = prctl(PR_GET_TIMERSLACK, 0UL, 0UL, 0UL, 0UL);
  pthread_sigmask(SIG_BLOCK, nullptr, &seen.blocked);
  seen.thread = gettid();
  return seen;
}

TEST(LoopThread, HasWhatItsGrantsSay) {
  LoopThread thread{{.priority = 7, .cpu = some_cpu()}};
  const Grants& grants = thread.grants();
  std::set<Right> asked;
  for (const Grant& grant : grants) {
    asked.insert(grant.right);
    EXPECT_NE(grant.state, "");
    EXPECT_EQ(grant.remedy.empty(), grant.granted) << grant.state;
  }
  EXPECT_EQ(asked, (std::set{Right::scheduling, Right::cpu, Right::memory, Right::heap,
                             Right::idle_states, Right::timer_slack}));
  EXPECT_EQ(grants.size(), asked.size());

  Seen inside;
  Seen afterwards;
  thread.start([&] { inside = look(); }, [&] { afterwards = look(); });
  thread.join();
  const bool fifo = grant_of(grants, Right::scheduling).granted;
  EXPECT_EQ(inside.policy, fifo ? (SCHED_FIFO | SCHED_RESET_ON_FORK) : SCHED_OTHER);
  EXPECT_EQ(inside.parameters.sched_priority, fifo ? 7 : 0);
  EXPECT_TRUE(grant_of(grants, Right::cpu).granted);
  EXPECT_EQ(inside.cpus, 1);
  EXPECT_TRUE(sigismember(&inside.blocked, SIGTERM));
  EXPECT_FALSE(sigismember(&inside.blocked, SIGSEGV));
  // The slack of a real-time thread is 0 whatever was set; after it, it shows again.
  EXPECT_LE(inside.slack_ns, 1);
  EXPECT_EQ(afterwards.policy & ~SCHED_RESET_ON_FORK, SCHED_OTHER);
  EXPECT_EQ(afterwards.thread, inside.thread);
  EXPECT_NE(inside.thread, gettid());
}

TEST(LoopThread, AsksForNothingInVirtualTime) {
  LoopThread thread;
  EXPECT_TRUE(thread.grants().empty());
  Seen inside;
  bool afterwards = false;
  thread.start([&] { inside = look(); }, [&] { afterwards = true; });
  thread.join();
  EXPECT_EQ(inside.policy, sched_getscheduler(0));
  EXPECT_TRUE(afterwards);
}

TEST(LoopThread, ThatIsNeverStartedEnds) {
  const LoopThread ordinary;
  const LoopThread with_rights{Settings{}};
}

TEST(LoopThread, LocksTheMemoryForAsLongAsItLives) {
  {
    const LoopThread thread{Settings{}};
    if (!grant_of(thread.grants(), Right::memory).granted || locked_kib() == 0)
      GTEST_SKIP() << "memory cannot be locked here, or a sanitizer keeps it from being";
    EXPECT_GT(locked_kib(), 1000U);
  }
  EXPECT_EQ(locked_kib(), 0U);
}

TEST(LoopThread, NamesACpuThatThereIsNot) {
  const LoopThread thread{{.priority = 80, .cpu = 1023}};
  const Grant& grant = grant_of(thread.grants(), Right::cpu);
  EXPECT_FALSE(grant.granted);
  EXPECT_EQ(grant.state, "CPU 1023 was refused: Invalid argument");
  EXPECT_THAT(grant.remedy, HasSubstr("set [loop] cpu to one that this process may use: "));
  EXPECT_THAT(grant.remedy, HasSubstr(std::to_string(some_cpu())));
}

// In a process of its own, without a right in the world.
[[noreturn]] void print_grants_of_nobody() {
  const rlimit no_priority{.rlim_cur = 0, .rlim_max = 0};
  const rlimit some_memory{.rlim_cur = 65536, .rlim_max = 65536};
  bool stripped = setrlimit(RLIMIT_RTPRIO, &no_priority) == 0;
  stripped = setrlimit(RLIMIT_MEMLOCK, &some_memory) == 0 && stripped;
  if (geteuid() == 0) stripped = setresuid(65534, 65534, 65534) == 0 && stripped;
  const LoopThread thread{Settings{}};
  std::fputs(describe_missing(thread.grants(), "  ").c_str(), stderr);
  std::_Exit(stripped ? 0 : 1);
}

TEST(LoopThreadDeathTest, OfNobodyNamesEachRightThatIsMissingAndWhatToDo) {
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  EXPECT_EXIT(print_grants_of_nobody(), testing::ExitedWithCode(0),
              "\n  scheduling: SCHED_FIFO 80 was refused: Operation not permitted: the limit of "
              "real-time priority \\(RLIMIT_RTPRIO\\) is 0; .*rtprio.*\n"
              "  memory: cannot be locked: the limit of locked memory \\(RLIMIT_MEMLOCK\\) is 64 "
              "KiB and must be unlimited; .*memlock");
}

// In a process of its own: with the priority and without the capability, as someone in limits.d.
[[noreturn]] void enter_and_leave_as_someone() {
  const Grant granted = enter({.priority = 20}).front();
  if (!granted.granted || setresuid(65534, 65534, 65534) != 0) std::_Exit(2);
  leave();
  std::_Exit((sched_getscheduler(0) & ~SCHED_RESET_ON_FORK) == SCHED_OTHER ? 0 : 1);
}

TEST(LoopThreadDeathTest, GivesThePriorityBackWithoutACapability) {
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  if (geteuid() != 0 || !has_capability(CAP_SYS_NICE))
    GTEST_SKIP() << "takes root to have the priority and to become someone else";
  EXPECT_EXIT(enter_and_leave_as_someone(), testing::ExitedWithCode(0), "");
}

TEST(Remedies, DependOnWhoStartedTheProgram) {
  const Starter person{.kind = Starter::Kind::person, .name = "ada"};
  EXPECT_EQ(allow_priority(person),
            "echo 'ada - rtprio 99' | sudo tee -a /etc/security/limits.d/90-sinerig.conf, then log "
            "in again");
  EXPECT_EQ(allow_locked_memory(person),
            "echo 'ada - memlock unlimited' | sudo tee -a /etc/security/limits.d/90-sinerig.conf, "
            "then log in again");
  EXPECT_EQ(allow_cpu_latency(person),
            "echo 'KERNEL==\"cpu_dma_latency\", OWNER=\"ada\"' | sudo tee "
            "/etc/udev/rules.d/90-sinerig.rules, then sudo udevadm trigger /dev/cpu_dma_latency");
  const Starter service{.kind = Starter::Kind::service, .name = "sinerig@gimbal.service"};
  EXPECT_EQ(allow_priority(service),
            "sudo systemctl edit sinerig@gimbal.service: under [Service] LimitRTPRIO=99");
  EXPECT_EQ(allow_locked_memory(service),
            "sudo systemctl edit sinerig@gimbal.service: under [Service] LimitMEMLOCK=infinity");
  EXPECT_THAT(allow_cpu_latency(service),
              HasSubstr("ExecStartPre=+/bin/chmod 0666 /dev/cpu_dma_latency"));
  const Starter container{.kind = Starter::Kind::container, .name = "root"};
  EXPECT_EQ(allow_priority(container),
            "start the container with --cap-add SYS_NICE --ulimit rtprio=99");
  EXPECT_THAT(allow_locked_memory(container), HasSubstr("--ulimit memlock=-1"));
  EXPECT_THAT(allow_cpu_latency(container), HasSubstr("--device /dev/cpu_dma_latency"));
}

TEST(Remedies, OfAMissingLatencyFileDependOnWhatThereIs) {
  const Starter person{.kind = Starter::Kind::person, .name = "ada"};
  const Starter service{.kind = Starter::Kind::service, .name = "sinerig@gimbal.service"};
  const Starter container{.kind = Starter::Kind::container, .name = "root"};
  for (const Starter& starter : {person, service, container}) {
    const Grant none = without_latency_file(ENOENT, starter, false);
    EXPECT_TRUE(none.granted);
    EXPECT_THAT(none.state, HasSubstr("no idle states"));
    EXPECT_EQ(none.remedy, "");
    const Grant refused = without_latency_file(EACCES, starter, true);
    EXPECT_FALSE(refused.granted);
    EXPECT_EQ(refused.remedy, allow_cpu_latency(starter));
  }
  EXPECT_THAT(without_latency_file(ENOENT, container, true).remedy,
              HasSubstr("--device /dev/cpu_dma_latency"));
  EXPECT_THAT(without_latency_file(ENOENT, service, true).remedy, HasSubstr("PrivateDevices=no"));
  EXPECT_THAT(without_latency_file(ENOENT, person, true).remedy, HasSubstr("CONFIG_CPU_IDLE"));
}

TEST(Remedies, OfARefusedClassLeaveTheThrottlingOn) {
  const Starter person{.kind = Starter::Kind::person, .name = "ada"};
  const Starter service{.kind = Starter::Kind::service, .name = "sinerig@gimbal.service"};
  const Starter container{.kind = Starter::Kind::container, .name = "root"};
  for (const Starter& starter : {person, service, container}) {
    EXPECT_THAT(allow_class(starter, false), testing::Not(HasSubstr("sched_rt_runtime_us")));
    EXPECT_THAT(allow_class(starter, true), HasSubstr("sched_rt_runtime_us=-1"));
  }
  EXPECT_THAT(allow_class(service, false), HasSubstr("RestrictRealtime=no"));
}

TEST(Capabilities, AreOfferedForWhatTheyGrant) {
  const auto grants = [](Right missing) {
    Grants all;
    for (const Right right : {Right::scheduling, Right::memory, Right::heap, Right::idle_states})
      all.push_back({.right = right, .granted = right != missing, .state = {}, .remedy = {}});
    return all;
  };
  EXPECT_TRUE(capabilities_would_help(grants(Right::scheduling)));
  EXPECT_TRUE(capabilities_would_help(grants(Right::memory)));
  EXPECT_FALSE(capabilities_would_help(grants(Right::idle_states)));
  EXPECT_FALSE(capabilities_would_help(grants(Right::cpu)));
}

TEST(Capabilities, CountOutsideOfUserNamespacesOnly) {
  EXPECT_TRUE(is_whole_machine("         0          0 4294967295\n"));
  EXPECT_FALSE(is_whole_machine("         0       1000          1\n"));
  EXPECT_FALSE(is_whole_machine("         0     100000      65536\n"));
  EXPECT_FALSE(is_whole_machine(""));
  EXPECT_EQ(outside_id("0 1000 1\n1 100000 65536\n", 0), 1000U);
  EXPECT_EQ(outside_id("0 1000 1\n1 100000 65536\n", 33), 100032U);
  EXPECT_EQ(outside_id("0 0 4294967295\n", 1000), 1000U);
}

}  // namespace
}  // namespace sinerig::realtime
