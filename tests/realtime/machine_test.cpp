// What the doctor says of a machine, on machines made of files.
#include "realtime/machine.h"

#include <filesystem>
#include <fstream>
#include <map>

#include <gmock/gmock.h>

namespace sinerig::realtime {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class Machine : public testing::Test {
 protected:
  Machine() { fs::remove_all(root_); }
  ~Machine() override { fs::remove_all(root_); }

  void put(const std::string& path, const std::string& text) const {
    fs::create_directories((root_ / path).parent_path());
    std::ofstream{root_ / path} << text << '\n';
  }
  void put_cpus(const std::string& isolated, const std::string& governor) const {
    put("sys/devices/system/cpu/online", "0-1");
    put("sys/devices/system/cpu/isolated", isolated);
    put("sys/devices/system/cpu/nohz_full", isolated.empty() ? "(null)" : isolated);
    for (const char* cpu : {"cpu0", "cpu1"})
      put(std::string{"sys/devices/system/cpu/"} + cpu + "/cpufreq/scaling_governor", governor);
  }
  void put_rest(const std::string& realtime, const std::string& runtime_us,
                const std::string& clock) const {
    put("sys/kernel/realtime", realtime);
    put("proc/sys/kernel/sched_rt_runtime_us", runtime_us);
    put("proc/sys/kernel/sched_rt_period_us", "1000000");
    put("sys/devices/system/clocksource/clocksource0/current_clocksource", clock);
    put("sys/devices/system/clocksource/clocksource0/available_clocksource", "tsc hpet acpi_pm ");
  }
  std::map<std::string, Finding> examine(const Settings& settings = {}) const {
    std::map<std::string, Finding> findings;
    for (const Finding& each : examine_machine(settings, root_.string())) {
      EXPECT_NE(each.state, "") << each.name;
      EXPECT_EQ(each.ok, each.remedy.empty()) << each.name;
      findings[each.name] = each;
    }
    return findings;
  }

  fs::path root_ =
      fs::path{testing::TempDir()} /
      (std::string{"machine-"} + testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(Machine, InGoodOrderNeedsNothing) {
  put_cpus("1", "performance");
  put_rest("1", "950000", "tsc");
  auto findings = examine({.priority = 80, .cpu = 1});
  for (const char* name :
       {"kernel", "isolcpus", "nohz_full", "throttling", "governor", "clocksource"})
    EXPECT_TRUE(findings.at(name).ok) << name;
  EXPECT_THAT(findings["kernel"].state, HasSubstr(", PREEMPT_RT"));
  EXPECT_EQ(findings["isolcpus"].state, "CPU 1 kept free of ordinary threads");
  EXPECT_EQ(findings["throttling"].state, "real-time threads may use 95 % of a CPU");
}

TEST_F(Machine, InBadOrderIsToldWhatToDo) {
  put_cpus("", "powersave");
  put_rest("0", "500000", "hpet");
  auto findings = examine();
  EXPECT_THAT(findings["kernel"].state, HasSubstr("not PREEMPT_RT"));
  EXPECT_THAT(findings["kernel"].remedy, HasSubstr("sudo apt install linux-image-rt-"));
  EXPECT_EQ(findings["isolcpus"].state, "no CPU is kept free of ordinary threads");
  EXPECT_EQ(findings["isolcpus"].remedy,
            "add isolcpus=managed_irq,domain,1 nohz_full=1 rcu_nocbs=1 to GRUB_CMDLINE_LINUX in "
            "/etc/default/grub, sudo update-grub, boot; [loop] cpu = 1");
  EXPECT_EQ(findings["nohz_full"].state, "no CPU is without a periodic tick");
  EXPECT_EQ(findings["throttling"].state, "real-time threads may use 50 % of a CPU");
  EXPECT_EQ(findings["throttling"].remedy, "sudo sysctl -w kernel.sched_rt_runtime_us=950000");
  EXPECT_EQ(findings["governor"].state, "\"powersave\": the CPU slows down between ticks");
  EXPECT_THAT(findings["governor"].remedy, HasSubstr("cpupower frequency-set -g performance"));
  EXPECT_EQ(findings["clocksource"].state, "hpet: every reading of the time is a system call");
  EXPECT_THAT(findings["clocksource"].remedy, HasSubstr("echo tsc | sudo tee "));
}

TEST_F(Machine, LooksAtTheCpuOfTheRigFile) {
  put_cpus("1", "performance");
  put("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "schedutil");
  auto other = examine({.priority = 80, .cpu = 0});
  EXPECT_EQ(other["isolcpus"].state, "CPU 0 is not kept free of ordinary threads");
  EXPECT_THAT(other["isolcpus"].remedy, HasSubstr("isolcpus=managed_irq,domain,0 "));
  EXPECT_FALSE(other["governor"].ok);
  auto own = examine({.priority = 80, .cpu = 1});
  EXPECT_TRUE(own["isolcpus"].ok);
  EXPECT_TRUE(own["governor"].ok);
}

TEST_F(Machine, WithACpuApartThatTheLoopDoesNotUseIsNotInOrder) {
  put_cpus("1", "performance");
  auto findings = examine();
  EXPECT_EQ(findings["isolcpus"].state,
            "CPU 1 is kept free of ordinary threads, but [loop] cpu names none");
  EXPECT_EQ(findings["isolcpus"].remedy, "set [loop] cpu = 1");
  EXPECT_FALSE(findings["nohz_full"].ok);
}

TEST_F(Machine, HasARealTimeKernelWhereItsVersionSaysSo) {
  put("proc/sys/kernel/version", "#1 SMP PREEMPT_RT Debian 6.12.57-1 (2025-11-05)");
  EXPECT_TRUE(examine()["kernel"].ok);
  put("proc/sys/kernel/version", "#1 SMP PREEMPT_DYNAMIC Debian 6.12.57-1 (2025-11-05)");
  EXPECT_FALSE(examine()["kernel"].ok);
  EXPECT_EQ(realtime_kernel("x86_64"), "sudo apt install linux-image-rt-amd64, then boot it");
  EXPECT_EQ(realtime_kernel("aarch64"), "sudo apt install linux-image-rt-arm64, then boot it");
  EXPECT_EQ(realtime_kernel("riscv64"), "boot a kernel that is built with CONFIG_PREEMPT_RT");
}

TEST_F(Machine, WithoutTheFilesIsSaidToBeUnknown) {
  auto findings = examine();
  EXPECT_FALSE(findings["kernel"].ok);
  EXPECT_EQ(findings["isolcpus"].remedy, "use a machine with two CPUs or more");
  EXPECT_EQ(findings["throttling"].state, "this kernel has none");
  EXPECT_EQ(findings["governor"].state, "the CPU's frequency is not the kernel's to change");
  EXPECT_EQ(findings["clocksource"].state, "not known");
}

TEST(CpuList, IsReadAsTheKernelWritesIt) {
  EXPECT_THAT(cpu_list("0-2,5"), ElementsAre(0, 1, 2, 5));
  EXPECT_THAT(cpu_list("7"), ElementsAre(7));
  EXPECT_THAT(cpu_list(""), IsEmpty());
  EXPECT_THAT(cpu_list("(null)"), IsEmpty());
}

}  // namespace
}  // namespace sinerig::realtime
