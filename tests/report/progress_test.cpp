#include "report/progress.h"

#include <algorithm>
#include <sstream>
#include <utility>

#include <gmock/gmock.h>

#include "report/remaining_time.h"

namespace sinerig::report {
namespace {

using testing::HasSubstr;

SweepPlan plan_of(std::uint32_t points) {
  SweepSettings sweep;
  sweep.start_hz = 1.0;
  sweep.stop_hz = 100.0;
  sweep.points = points;
  sweep.amplitude = 1.0;
  return plan_sweep(sweep, {}, 1000.0);
}

Point point_of(std::uint32_t dwell, PointStatus status = PointStatus::good) {
  Point point{.dwell = dwell};
  point.frequency_hz = 1.0 + dwell;
  point.response = {0.0, -2.0};
  point.gain_interval_db = 0.02;
  point.phase_interval_deg = 0.3;
  point.status = status;
  return point;
}

Progress::Screen wide() {
  return {.columns = 100, .rows = 40, .colour = true};
}

TEST(Progress, IsALinePerPointInAPipe) {
  std::ostringstream stream;
  Progress progress{stream, Progress::Style::lines, plan_of(20), wide};
  Point third = point_of(2);
  third.pair = 1;
  progress.point(point_of(1));
  progress.point(third);
  progress.update(3, 4000);
  progress.close();
  EXPECT_EQ(stream.str(),
            "   1/20     2.0000 Hz      6.021 dB ±0.02       -90.00° ±0.3      good\n");
}

TEST(Progress, DrawsAPictureAndTakesItAway) {
  std::ostringstream stream;
  Progress progress{stream, Progress::Style::live, plan_of(20), wide};
  for (std::uint32_t i = 0; i < 8; ++i) progress.point(point_of(i));
  progress.point(point_of(8, PointStatus::unsettled));
  progress.update(9, 12345);
  const std::string picture = stream.str();
  EXPECT_THAT(picture, HasSubstr("10/20"));
  EXPECT_THAT(picture, HasSubstr("0:12 elapsed"));
  EXPECT_THAT(picture, HasSubstr("1 not good"));
  EXPECT_THAT(picture, HasSubstr("unsettled"));
  EXPECT_THAT(picture, HasSubstr("100 Hz"));
  const auto lines = std::count(picture.begin(), picture.end(), '\n');
  progress.close();
  EXPECT_THAT(stream.str(), testing::EndsWith("\033[" + std::to_string(lines) + "A\r\033[J"));
}

TEST(Progress, NamesWhatRefinementAddsAndWhatAModelEnded) {
  std::ostringstream stream;
  SweepPlan plan = plan_of(2);
  plan.refinement.most_points = 4;
  Progress lines{stream, Progress::Style::lines, plan, wide};
  for (std::uint32_t i = 0; i < 3; ++i) {
    Point point = point_of(i);
    if (i == 2) point.settled_by = SettledBy::model;
    lines.point(point);
  }
  EXPECT_THAT(stream.str(), HasSubstr("   2/2     2.0000 Hz"));
  EXPECT_THAT(stream.str(), HasSubstr("   2+1     3.0000 Hz"));
  EXPECT_THAT(stream.str(), testing::EndsWith("good, transient modelled\n"));
  std::ostringstream drawn;
  Progress live{drawn, Progress::Style::live, plan, wide};
  live.update(3, 2000);
  EXPECT_THAT(drawn.str(), HasSubstr("2+2  \033[1mrefining"));
  EXPECT_THAT(drawn.str(), testing::Not(HasSubstr(" left")));
}

TEST(Progress, IsALinePerPointWhereAPictureHasNoRoom) {
  const std::pair<std::size_t, std::size_t> sizes[] = {{79, 40}, {100, 13}};
  for (const auto& [columns, rows] : sizes) {
    std::ostringstream stream;
    Progress progress{stream, Progress::Style::live, plan_of(20), [columns = columns, rows = rows] {
                        return Progress::Screen{.columns = columns, .rows = rows};
                      }};
    progress.point(point_of(1));
    progress.update(3, 4000);
    EXPECT_THAT(stream.str(), testing::EndsWith("good\n")) << columns << " x " << rows;
    EXPECT_THAT(stream.str(), testing::Not(HasSubstr("\033"))) << columns << " x " << rows;
  }
}

// A picture takes all of its lines and one for the cursor: 14.
TEST(Progress, GoesOnInLinesWhereTheWindowGetsTooSmall) {
  std::ostringstream stream;
  std::size_t rows = 14;
  Progress progress{stream, Progress::Style::live, plan_of(20), [&rows] {
                      return Progress::Screen{.columns = 100, .rows = rows};
                    }};
  progress.update(1, 1000);
  EXPECT_EQ(std::ranges::count(stream.str(), '\n'), 13);
  rows = 13;
  stream.str("");
  progress.point(point_of(1));
  EXPECT_THAT(stream.str(), testing::StartsWith("\033[13A\r\033[J   1/20 "));
  EXPECT_THAT(stream.str(), testing::EndsWith("good\n"));
}

TEST(Progress, IsPlainWhereColourIsRefused) {
  std::ostringstream stream;
  Progress progress{stream, Progress::Style::live, plan_of(20), [] {
                      return Progress::Screen{.columns = 100, .rows = 40, .colour = false};
                    }};
  progress.point(point_of(0));
  progress.update(1, 1000);
  const std::string picture = stream.str();
  EXPECT_THAT(picture, HasSubstr("2/20"));
  EXPECT_THAT(picture, testing::Not(testing::ContainsRegex("\033\\[[0-9]+m")));
}

TEST(Progress, SaysNothingWhenToldSo) {
  std::ostringstream stream;
  Progress progress{stream, Progress::Style::none, plan_of(20), wide};
  progress.point(point_of(0));
  progress.update(1, 1000);
  progress.close();
  EXPECT_EQ(stream.str(), "");
}

TEST(RemainingTime, LearnsFromWhatDwellsTook) {
  const SweepPlan plan = plan_of(10);
  RemainingTime time{plan};
  EXPECT_DOUBLE_EQ(time.remaining_s(), plan.min_seconds());
  // Each dwell takes twice its least.
  std::uint64_t tick = 0;
  for (std::uint32_t dwell = 0; dwell < 5; ++dwell) {
    time.update(dwell, tick);
    tick += 2 * plan.dwells[dwell].min_samples();
  }
  time.update(5, tick);
  double left_s = 0.0;
  for (std::uint32_t dwell = 5; dwell < 10; ++dwell)
    left_s += 2.0 * static_cast<double>(plan.dwells[dwell].min_samples()) / plan.rate_hz;
  EXPECT_NEAR(time.remaining_s(), left_s, 1e-9);
  EXPECT_NEAR(time.elapsed_s() + time.remaining_s(), 2.0 * plan.min_seconds(), 1e-9);
  time.update(10, tick);
  EXPECT_EQ(time.remaining_s(), 0.0);
  EXPECT_EQ(time.done(), 1.0);
}

}  // namespace
}  // namespace sinerig::report
