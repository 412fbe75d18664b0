// What the page is told of a run.
#include "report/report_data.h"

#include <limits>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "report/run_summary.h"
#include "report/xml.h"
#include "support/stored_runs.h"

namespace sinerig::report {
namespace {

using testing::HasSubstr;
using testing::Not;

LabelledRun run_of(std::size_t points) {
  return {.label = "axis", .run = test::two_channel_run(points)};
}

std::string notes_of(const nlohmann::ordered_json& page) {
  return page["notes"].dump();
}

TEST(ReportData, TellsOfAHoldOnlyWhereThereIsOne) {
  LabelledRun run = run_of(10);
  for (record::StoredResponse& response : run.run.responses) response.hold_rate_hz = 0.0;
  EXPECT_THAT(notes_of(page_of_run(run)), Not(HasSubstr("zero-order hold")));
  EXPECT_THAT(notes_of(page_of_comparison({run, run}, {})), Not(HasSubstr("zero-order hold")));
  LabelledRun held = run;
  held.run.responses.back().hold_rate_hz = 1000.0;
  EXPECT_THAT(notes_of(page_of_run(held)), HasSubstr("zero-order hold"));
  EXPECT_THAT(notes_of(page_of_comparison({run, held}, {})), HasSubstr("zero-order hold"));
}

std::string fact(const nlohmann::ordered_json& facts, const std::string& name) {
  for (const auto& each : facts)
    if (each[0].get<std::string>().starts_with(name)) return each[1];
  return {};
}

// A point that was clipped, or drowned in noise, is none to boast of.
TEST(ReportData, HeadlinesComeFromGoodPoints) {
  LabelledRun run = run_of(12);
  std::vector<record::StoredPoint>& points = run.run.responses.front().points;
  for (record::StoredPoint& point : points) point.status = "good";
  const auto before = summary_facts(run.run);
  record::StoredPoint bad = points.front();
  bad.status = "low_signal";
  bad.response *= 1000.0;
  bad.gain_interval_db = 40.0;
  for (int i = 0; i < 15; ++i) points.push_back(bad);
  const auto after = summary_facts(run.run);
  for (const char* name : {"Largest gain", "95 % interval"}) {
    EXPECT_NE(fact(before, name), "") << name;
    EXPECT_EQ(fact(after, name), fact(before, name)) << name;
  }
  for (record::StoredPoint& point : points) point.status = "clipped";
  EXPECT_EQ(fact(summary_facts(run.run), "Largest gain"), "");
}

TEST(XmlText, HoldsWhatXmlMayHold) {
  EXPECT_EQ(xml_text("a<b> & \"c\"\n"), "a&lt;b&gt; &amp; &quot;c&quot;\n");
  EXPECT_EQ(xml_text("Ω ± 𝄞 é"), "Ω ± 𝄞 é");
  EXPECT_EQ(xml_text("caf\xe9.csv"), "caf\uFFFD.csv");
  EXPECT_EQ(xml_text("x\x01.csv"), "x\uFFFD.csv");
  EXPECT_EQ(xml_text("\xc0\xaf"), "\uFFFD\uFFFD") << "an overlong slash";
  EXPECT_EQ(xml_text("\xed\xa0\x80"), "\uFFFD\uFFFD\uFFFD") << "half of a surrogate pair";
  EXPECT_EQ(xml_text("\xe2\x82"), "\uFFFD\uFFFD") << "cut off";
  EXPECT_EQ(xml_text("\xf4\x90\x80\x80"), "\uFFFD\uFFFD\uFFFD\uFFFD") << "beyond the last";
}

}  // namespace
}  // namespace sinerig::report
