// One thread puts, one takes: nothing that matters is lost, and the loop never waits.
#include "sweep/outbox.h"

#include <thread>

#include <gtest/gtest.h>

namespace sinerig {
namespace {

Event event(std::uint64_t tick) {
  return {.tick = tick};
}

std::vector<std::uint64_t> take_events(Outbox& outbox) {
  std::vector<std::uint64_t> ticks;
  Record record;
  while (outbox.try_take(record)) {
    if (const auto* each = std::get_if<Event>(&record)) ticks.push_back(each->tick);
  }
  return ticks;
}

TEST(RecordQueue, HoldsAsManyAsItsCapacityRoundedUp) {
  RecordQueue queue{5};
  EXPECT_EQ(queue.free(), 8U);
  for (std::uint64_t i = 0; i < 8; ++i) EXPECT_TRUE(queue.try_push(event(i)));
  EXPECT_FALSE(queue.try_push(event(8)));
  Record record;
  for (std::uint64_t i = 0; i < 8; ++i) {
    ASSERT_TRUE(queue.try_pop(record));
    EXPECT_EQ(std::get<Event>(record).tick, i);
  }
  EXPECT_FALSE(queue.try_pop(record));
}

TEST(Outbox, DropsSamplesWhenFullAndCountsThem) {
  Outbox outbox{8, 8, Outbox::WhenFull::keep};
  for (std::uint64_t i = 0; i < 20; ++i) outbox.put_sample({.tick = i});
  EXPECT_EQ(outbox.dropped_samples(), 14U);  // a quarter of the slots is kept for the rest
  outbox.put(event(1));
  outbox.put(event(2));
  EXPECT_EQ(take_events(outbox), (std::vector<std::uint64_t>{1, 2}));
}

TEST(Outbox, KeepsEventsInOrderBeyondTheQueue) {
  Outbox outbox{4, 16, Outbox::WhenFull::keep};
  for (std::uint64_t i = 0; i < 10; ++i) outbox.put(event(i));
  std::vector<std::uint64_t> all = take_events(outbox);
  for (int round = 0; round < 4; ++round) {
    EXPECT_TRUE(outbox.flush());
    for (const std::uint64_t tick : take_events(outbox)) all.push_back(tick);
  }
  ASSERT_EQ(all.size(), 10U);
  for (std::uint64_t i = 0; i < 10; ++i) EXPECT_EQ(all[i], i);
}

TEST(Outbox, TellsTheLoopToStopBeforeAnythingIsLost) {
  Outbox outbox{4, 16, Outbox::WhenFull::keep};
  std::uint64_t put = 0;
  while (outbox.flush() && put < 100) outbox.put(event(put++));
  EXPECT_EQ(put, 4U + 8U + 1U);  // the queue and half of the backlog
  std::vector<std::uint64_t> all;
  for (int round = 0; round < 8; ++round) {
    outbox.flush();
    for (const std::uint64_t tick : take_events(outbox)) all.push_back(tick);
  }
  EXPECT_EQ(all.size(), put);
}

TEST(Outbox, AbandonedTellsTheLoopToStopAndHoldsNobodyUp) {
  for (const auto when_full : {Outbox::WhenFull::keep, Outbox::WhenFull::wait}) {
    Outbox outbox{4, 4, when_full};
    outbox.put(event(0));
    EXPECT_TRUE(outbox.flush());
    outbox.abandon();
    EXPECT_FALSE(outbox.flush());
    for (std::uint64_t i = 0; i < 100; ++i) outbox.put(event(i));
    outbox.close();
    EXPECT_TRUE(outbox.closed());
  }
}

class TwoThreads : public testing::TestWithParam<Outbox::WhenFull> {};

TEST_P(TwoThreads, HandOverEveryEventInOrder) {
  constexpr std::uint64_t events = 20'000;
  Outbox outbox{64, 1U << 15U, GetParam()};
  std::vector<std::uint64_t> taken;
  std::uint64_t samples = 0;
  std::thread consumer{[&] {
    Record record;
    while (true) {
      const bool last_look = outbox.closed();
      if (outbox.try_take(record)) {
        if (const auto* each = std::get_if<Event>(&record)) taken.push_back(each->tick);
        samples += std::holds_alternative<TickSamples>(record) ? 1U : 0U;
      } else if (last_look) {
        return;
      } else {
        std::this_thread::yield();
      }
    }
  }};
  for (std::uint64_t i = 0; i < events; ++i) {
    outbox.put(event(i));
    outbox.put_sample({.tick = i});
    outbox.flush();
  }
  outbox.close();
  consumer.join();
  ASSERT_EQ(taken.size(), events);
  for (std::uint64_t i = 0; i < events; ++i) ASSERT_EQ(taken[i], i);
  EXPECT_EQ(samples + outbox.dropped_samples(), events);
  if (GetParam() == Outbox::WhenFull::wait) {
    EXPECT_EQ(outbox.dropped_samples(), 0U);
  }
}

INSTANTIATE_TEST_SUITE_P(Modes, TwoThreads,
                         testing::Values(Outbox::WhenFull::keep, Outbox::WhenFull::wait));

}  // namespace
}  // namespace sinerig
