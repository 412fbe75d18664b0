// The page and the night's summary say of a comparison what the exit code says.
#include <sstream>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "report/comparison.h"
#include "report/night_summary.h"
#include "report/report_data.h"
#include "support/stored_runs.h"

namespace sinerig::report {
namespace {

using record::Difference;
using testing::HasSubstr;
using testing::Not;

LabelledRun run_of(const std::string& label) {
  return {.label = label, .run = test::two_channel_run(12)};
}

// `compared` points that are the same, `lost` that are not good any more.
Difference same_but(std::size_t compared, std::size_t lost) {
  Difference difference;
  difference.file = "b";
  difference.name = "b encoder";
  difference.points.resize(compared);
  for (std::size_t i = 0; i < compared; ++i) {
    difference.points[i].frequency_hz = 1.0 + static_cast<double>(i);
    difference.points[i].probability = 0.5;
  }
  difference.lost = difference.unusable = lost;
  return difference;
}

nlohmann::ordered_json page(const Difference& difference) {
  return page_of_comparison({run_of("a"), run_of("b")}, {difference});
}

std::string night(const Difference& difference) {
  std::ostringstream words;
  NightRow row;
  row.name = "b";
  row.repeat = 2;
  row.differences = {difference};
  print_night(words, "job", {row});
  return words.str();
}

TEST(Verdict, WhereManyPointsAreLostItHasChanged) {
  const Difference difference = same_but(12, 6);
  ASSERT_TRUE(difference.changed());
  EXPECT_EQ(page(difference)["outcome"], "changed");
  EXPECT_EQ(page(difference)["outcome_text"], "changed");
  EXPECT_EQ(page(difference)["summary"][0][1], "changed");
  EXPECT_THAT(page(difference)["summary"][0][2].get<std::string>(), HasSubstr("6 lost"));
  EXPECT_THAT(page(difference)["differences"][0]["verdict"].get<std::string>(),
              testing::StartsWith("changed"));
  EXPECT_THAT(night(difference), HasSubstr("b encoder: changed: 6 of 18 points lost; most at"));
  EXPECT_THAT(night(difference), Not(HasSubstr("0 of 12 points changed")));
}

TEST(Verdict, WhereEveryPointIsLostItHasChangedToo) {
  const Difference difference = same_but(0, 12);
  EXPECT_EQ(page(difference)["outcome"], "changed");
  EXPECT_THAT(night(difference), HasSubstr("b encoder: changed: 12 of 12 points lost"));
  EXPECT_THAT(night(difference), Not(HasSubstr("nothing to compare")));
}

TEST(Verdict, WhatCannotBeComparedIsNotTheSame) {
  const Difference difference = same_but(0, 0);
  ASSERT_FALSE(difference.changed());
  EXPECT_EQ(page(difference)["outcome"], "failed");
  EXPECT_EQ(page(difference)["outcome_text"], "nothing to compare in b");
  EXPECT_EQ(page(difference)["summary"][0][1], "nothing compared");
  // Nor is a file that has no channel in common with the first.
  EXPECT_EQ(page_of_comparison({run_of("a"), run_of("b")}, {})["outcome"], "failed");
}

TEST(Verdict, TheSameIsTheSame) {
  EXPECT_EQ(page(same_but(12, 0))["outcome"], "done");
  EXPECT_EQ(page(same_but(12, 0))["outcome_text"], "same within the scatter");
  EXPECT_THAT(night(same_but(12, 1)), HasSubstr("b encoder: same in 12 points; most at"));
}

}  // namespace
}  // namespace sinerig::report
