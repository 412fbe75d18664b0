// Times of day, and waiting for them.
#include "cli/wall_time.h"

#include <cstdlib>
#include <ctime>

#include <gtest/gtest.h>

namespace sinerig::cli {
namespace {

class LocalTime : public testing::Test {
 protected:
  LocalTime() {
    setenv("TZ", "CET-1CEST,M3.5.0,M10.5.0/3", 1);
    tzset();
  }
  ~LocalTime() override {
    unsetenv("TZ");
    tzset();
  }
};

constexpr std::int64_t evening_s = 1772398800;  // 2026-03-01T21:00:00Z, 22:00 in CET

TEST_F(LocalTime, OfDayIsTheNextOne) {
  EXPECT_EQ(utc_text(next_time_of_day(evening_s, 22 * 3600 + 1800)), "2026-03-01T21:30:00Z");
  EXPECT_EQ(utc_text(next_time_of_day(evening_s, 2 * 3600)), "2026-03-02T01:00:00Z");
  EXPECT_EQ(next_time_of_day(evening_s, 22 * 3600), evening_s) << "now is not too late";
  EXPECT_EQ(utc_text(next_time_of_day(evening_s + 1, 22 * 3600)), "2026-03-02T21:00:00Z");
  EXPECT_EQ(local_time_text(evening_s), "22:00:00");
}

TEST_F(LocalTime, OfDayFollowsTheChangeOfTheClocks) {
  const std::int64_t before_s = evening_s + 27 * 86400;  // 2026-03-28 22:00 CET
  EXPECT_EQ(utc_text(next_time_of_day(before_s, 6 * 3600)), "2026-03-29T04:00:00Z");  // CEST
}

TEST(PassingTime, PassesAtOnceAndNeverBack) {
  PassingTime time{1000};
  const std::atomic<int> none{0};
  int called = 0;
  const auto meanwhile = [&] {
    ++called;
  };
  EXPECT_TRUE(time.wait_until(5000, none, meanwhile));
  EXPECT_EQ(called, 1);
  EXPECT_EQ(time.now_s(), 5000);
  EXPECT_TRUE(time.wait_until(4000, none, meanwhile));
  EXPECT_EQ(time.now_s(), 5000);
  time.pass(60.5);
  EXPECT_EQ(time.now_s(), 5060);
  const std::atomic<int> stop{1};
  EXPECT_FALSE(time.wait_until(9000, stop, meanwhile));
}

TEST(PassingTime, ElapsesAsItPasses) {
  PassingTime time{1000};
  const std::atomic<int> none{0};
  EXPECT_TRUE(time.wait_for(2.5, none, [] {}));
  EXPECT_TRUE(time.wait_for(-5.0, none, [] {}));
  time.pass(1.0);
  EXPECT_EQ(time.elapsed_s(), 3.5);
  EXPECT_EQ(time.now_s(), 1003);
}

TEST(SystemTime, WaitsNoLongerThanItIsTold) {
  SystemTime time;
  const std::atomic<int> none{0};
  EXPECT_TRUE(time.wait_until(time.now_s(), none, [] {}));
  const std::atomic<int> stop{1};
  EXPECT_FALSE(time.wait_until(time.now_s() + 1000, stop, [] {}));
  EXPECT_TRUE(time.wait_for(0.0, none, [] {}));
  EXPECT_TRUE(time.wait_for(-1000.0, none, [] {}));
  EXPECT_FALSE(time.wait_for(1000.0, stop, [] {}));
  const double before_s = time.elapsed_s();
  EXPECT_LE(before_s, time.elapsed_s());
}

}  // namespace
}  // namespace sinerig::cli
