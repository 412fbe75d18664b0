// What the live page says is under way, from the records as the loop puts them.
#include "dashboard/whereabouts.h"

#include <gtest/gtest.h>

namespace sinerig::dashboard {
namespace {

using Kind = Whereabouts::Kind;

class WhereaboutsTest : public testing::Test {
 protected:
  WhereaboutsTest() {
    SweepSettings sweep;
    sweep.start_hz = 2.0;
    sweep.stop_hz = 100.0;
    sweep.points = 6;
    sweep.amplitude = 0.4;
    sweep.tones = 2;
    sweep.refine_points = 4;
    plan_ = plan_sweep(sweep, {}, 1000.0);
    planned_ = static_cast<std::uint32_t>(plan_.dwells.size());
  }

  static Record sample(std::uint64_t tick, std::uint32_t dwell) {
    return TickSamples{.tick = tick, .dwell = dwell, .channels = 0};
  }
  static Record event(EventKind kind, std::uint32_t dwell, double value = 0.0,
                      std::uint32_t candidate = 0) {
    return Event{.kind = kind, .dwell = dwell, .tick = 100, .value = value, .candidate = candidate};
  }
  static Record end(std::uint32_t dwell) { return DwellTiming{.dwell = dwell}; }

  SweepPlan plan_;
  std::uint32_t planned_ = 0;
};

TEST_F(WhereaboutsTest, FollowsThePlanToItsEnd) {
  Whereabouts where{plan_, false};
  EXPECT_EQ(where.kind(), Kind::waiting);
  EXPECT_EQ(where.under_way(), nullptr);
  EXPECT_TRUE(where.take(event(EventKind::dwell_began, 0)));
  EXPECT_EQ(where.kind(), Kind::planned);
  ASSERT_NE(where.under_way(), nullptr);
  EXPECT_EQ(where.under_way()->tones.size(), plan_.dwells[0].tones.size());
  EXPECT_EQ(where.amplitude(), plan_.dwells[0].tones.front().amplitude);
  EXPECT_FALSE(where.take(sample(350, 0)));
  EXPECT_DOUBLE_EQ(where.seconds(), 0.25);
  EXPECT_FALSE(where.take(end(0)));
  EXPECT_TRUE(where.take(event(EventKind::dwell_began, 1)));
  where.take(end(1));
  EXPECT_TRUE(where.take(sample(400, planned_)));
  EXPECT_EQ(where.kind(), Kind::closing);
  EXPECT_FALSE(where.take(sample(401, planned_)));
}

TEST_F(WhereaboutsTest, KeepsTheLevelOfARetry) {
  Whereabouts where{plan_, false};
  where.take(event(EventKind::dwell_began, 0));
  EXPECT_FALSE(where.take(event(EventKind::retried, 0, 0.125)));
  EXPECT_TRUE(where.take(event(EventKind::dwell_began, 0)));
  EXPECT_EQ(where.amplitude(), 0.125);
  EXPECT_EQ(where.retries(), 1U);
  where.take(end(0));
  where.take(event(EventKind::dwell_began, 1));
  EXPECT_EQ(where.retries(), 0U);
  EXPECT_EQ(where.amplitude(), plan_.dwells[1].tones.front().amplitude);
}

TEST_F(WhereaboutsTest, NamesPreflightAndProbe) {
  plan_.probe = {.command = {0.0, 0.1, 0.0}, .quiet_samples = 0, .low_hz = 2.0, .high_hz = 100.0};
  Whereabouts where{plan_, true};
  where.take(event(EventKind::dwell_began, 0));
  EXPECT_EQ(where.kind(), Kind::preflight);
  EXPECT_EQ(where.amplitude(), 0.0);
  where.take(Preflight{});
  EXPECT_TRUE(where.take(sample(500, 0)));
  EXPECT_EQ(where.kind(), Kind::probe);
  EXPECT_EQ(where.under_way(), nullptr);
  EXPECT_FALSE(where.take(sample(501, 0)));
  EXPECT_FALSE(where.take(event(EventKind::probed, 0, 2.0)));
  EXPECT_TRUE(where.take(event(EventKind::dwell_began, 0)));
  EXPECT_EQ(where.kind(), Kind::planned);
}

TEST_F(WhereaboutsTest, NamesWhatRefinementAddsAndWhatIsMeasuredAgain) {
  ASSERT_GT(plan_.refinement.candidates.size(), 1U);
  Whereabouts where{plan_, false};
  EXPECT_FALSE(where.take(event(EventKind::refined, planned_, 0.9, 1)));
  EXPECT_TRUE(where.take(event(EventKind::dwell_began, planned_)));
  EXPECT_EQ(where.kind(), Kind::refined);
  ASSERT_NE(where.under_way(), nullptr);
  EXPECT_EQ(where.under_way()->frequency_hz(plan_.rate_hz),
            plan_.refinement.candidates[1].frequency_hz(plan_.rate_hz));
  EXPECT_EQ(where.added().size(), 1U);
  where.take(end(planned_));
  where.take(event(EventKind::remeasured, 1));
  where.take(event(EventKind::dwell_began, 1));
  EXPECT_EQ(where.kind(), Kind::remeasured);
  EXPECT_EQ(where.dwell(), 1U);
}

TEST_F(WhereaboutsTest, KnowsWhatWasAddedBeforeTheRunWasResumed) {
  Whereabouts where{plan_, false};
  where.add(1);
  EXPECT_TRUE(where.take(event(EventKind::dwell_began, planned_)));
  EXPECT_EQ(where.kind(), Kind::refined);
  ASSERT_NE(where.under_way(), nullptr);
  EXPECT_EQ(where.under_way()->frequency_hz(plan_.rate_hz),
            plan_.refinement.candidates[1].frequency_hz(plan_.rate_hz));
}

}  // namespace
}  // namespace sinerig::dashboard
