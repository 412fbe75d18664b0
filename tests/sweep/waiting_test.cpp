// Whoever waits for a device outside of the loop can be stopped, and shows that it is at work.
#include "sweep/waiting.h"

#include <gtest/gtest.h>

namespace sinerig {
namespace {

constexpr std::int64_t a_year_ns = 31'536'000'000'000'000;

TEST(Waiting, IsEndedByAStopRequest) {
  RunControl control;
  const Waiting waiting{control};
  EXPECT_NO_THROW(waiting.go_on());
  EXPECT_TRUE(waiting.pause_for(0));
  control.stop_requests = 1;
  EXPECT_THROW(waiting.go_on(), StopRequested);
  EXPECT_FALSE(waiting.pause_for(a_year_ns));
}

TEST(Waiting, OnAWayOutIsNotCutShort) {
  RunControl control;
  control.stop_requests = 2;
  const Waiting waiting = Waiting{control}.to_the_end();
  EXPECT_TRUE(waiting.may_go_on());
  EXPECT_TRUE(waiting.pause_for(1));
}

TEST(Waiting, IsProgressWithEveryTurn) {
  RunControl control;
  const Waiting waiting{control};
  waiting.pause_for(3 * Waiting::turn_ns);
  const std::uint64_t after_three_turns = control.progress();
  EXPECT_GE(after_three_turns, 3U);
  waiting.to_the_end().may_go_on();
  EXPECT_EQ(control.progress(), after_three_turns + 1);
  control.tick = 7;
  EXPECT_EQ(control.progress(), after_three_turns + 8);
}

TEST(Waiting, AsNobodyIsAnsweredToNobody) {
  EXPECT_TRUE(Waiting{}.may_go_on());
}

}  // namespace
}  // namespace sinerig
