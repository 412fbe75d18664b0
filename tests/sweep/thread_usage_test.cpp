// What the machine does to the loop's thread: read at the end of each dwell and at no other time,
// so that no fault is lost between two dwells and no tick pays for it.
#include <unistd.h>

#include <gtest/gtest.h>
#include <sys/mman.h>

#include "support/collecting_sink.h"
#include "support/fake_rig.h"
#include "support/virtual_run.h"

namespace sinerig {
namespace {

// One page fault at every tick, and a disk read at every hundredth; notes at which ticks it was
// asked.
class FaultingClock final : public Clock {
 public:
  FaultingClock() : Clock{TickGrid{1000.0}} {}
  Tick wait() noexcept override { return {.index = next_++, .lateness = {}}; }
  Instant now() const noexcept override { return {.tick = next_ == 0 ? 0 : next_ - 1}; }
  std::int64_t time_ns(Instant instant) const noexcept override {
    return grid().time_ns(instant.tick);
  }
  std::optional<ThreadUsage> usage() const noexcept override {
    const test::OutsideTheLoop noting_down;
    asked.push_back(next_);
    return ThreadUsage{
        .minor_faults = 1000 + next_, .major_faults = next_ / 100, .involuntary_switches = 7};
  }

  mutable std::vector<std::uint64_t> asked;  // after how many ticks

 private:
  std::uint64_t next_ = 0;
};

TEST(ThreadUsage, OfEachDwellIsReadInItsLastTickOnly) {
  SweepSettings sweep;
  sweep.spacing = Spacing::list;
  sweep.frequencies_hz = {20.0, 50.0, 100.0};
  sweep.amplitude = 0.5;
  FaultingClock clock;
  test::FakeActuator actuator{clock};
  test::FakeSensor sensor{clock, [&](std::uint64_t) {
                            return actuator.last;
                          }};
  Sensor* const sensors[] = {&sensor};
  Guard guard{test::open_guard(1), clock.grid().period_s()};
  test::CollectingSink sink;
  SweepRunner runner{plan_sweep(sweep, {}, 1000.0), {}, clock, actuator, sensors, guard, sink};
  RunControl control;
  runner.run(control);

  ASSERT_EQ(sink.timings.size(), 3U);
  std::vector<std::uint64_t> ends{0};
  for (const DwellTiming& timing : sink.timings) {
    const std::uint64_t begin = ends.back();
    ends.push_back(begin + timing.ticks);
    ASSERT_TRUE(timing.usage);
    EXPECT_EQ(timing.usage->minor_faults, timing.ticks);
    EXPECT_EQ(timing.usage->major_faults, ends.back() / 100 - begin / 100);
    EXPECT_EQ(timing.usage->involuntary_switches, 0U);
  }
  EXPECT_EQ(clock.asked, ends);
}

TEST(ThreadUsage, IsNotKnownInVirtualTime) {
  EXPECT_EQ(VirtualClock{TickGrid{1000.0}}.usage(), std::nullopt);
}

TEST(ThreadUsage, CountsThePagesThatTheThreadTouchesFirst) {
  constexpr std::size_t pages = 64;
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  const MonotonicClock clock{TickGrid{1000.0}};
  void* const memory =
      mmap(nullptr, pages * page, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(memory, MAP_FAILED);
  madvise(memory, pages * page, MADV_NOHUGEPAGE);
  const ThreadUsage before = clock.usage().value();
  for (std::size_t i = 0; i < pages; ++i) static_cast<volatile char*>(memory)[i * page] = 1;
  const ThreadUsage used = clock.usage().value() - before;
  munmap(memory, pages * page);
  EXPECT_GE(used.minor_faults, pages);
}

}  // namespace
}  // namespace sinerig
