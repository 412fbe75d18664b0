#include "report/figure.h"

#include <cmath>
#include <regex>
#include <sstream>

#include <gtest/gtest.h>

#include "report/raster.h"
#include "support/stored_runs.h"

namespace sinerig::report {
namespace {

std::string picture(std::size_t points) {
  const LabelledRun run{.label = "a<b", .run = test::two_channel_run(points)};
  std::ostringstream stream;
  write_bode_svg(stream, run, run.run.responses.front());
  return stream.str();
}

std::size_t occurrences(const std::string& text, const std::string& pattern) {
  const std::regex expression{pattern};
  return static_cast<std::size_t>(
      std::distance(std::sregex_iterator{text.begin(), text.end(), expression}, {}));
}

TEST(Figure, DrawsEveryPointOnceInGainAndPhase) {
  const std::string svg = picture(40);
  // Six points are not good, one of them without a response.
  EXPECT_EQ(occurrences(svg, "<circle"), 2U * 34U);
  EXPECT_EQ(occurrences(svg, "<title>"), 2U * 5U);
  EXPECT_EQ(occurrences(svg, "nan|inf"), 0U);
}

TEST(Figure, NamesWhatItShows) {
  const std::string svg = picture(10);
  EXPECT_NE(svg.find("a&lt;b: encoder"), std::string::npos);
  EXPECT_NE(svg.find("Gain, dB re 1 rad/Nm"), std::string::npos);
}

TEST(Figure, DrawsOnePointAndNone) {
  EXPECT_EQ(occurrences(picture(1), "nan|inf"), 0U);
  const LabelledRun none{.label = "none", .run = test::two_channel_run(0)};
  std::ostringstream stream;
  write_bode_svg(stream, none, none.run.responses.front());
  EXPECT_EQ(occurrences(stream.str(), "nan|inf"), 0U);
}

// 6 dB, half of them a unit in the last place above.
TEST(Figure, DrawsAGainThatIsConstantUpToRounding) {
  LabelledRun run{.label = "flat", .run = test::two_channel_run(20)};
  const double gain = std::pow(10.0, 6.0 / 20.0);
  for (record::StoredPoint& point : run.run.responses.front().points)
    point.response = point.dwell % 2 == 0 ? gain : std::nextafter(gain, 10.0);
  std::ostringstream stream;
  write_bode_svg(stream, run, run.run.responses.front());
  EXPECT_EQ(occurrences(stream.str(), "nan|inf"), 0U);
  EXPECT_LT(stream.str().size(), 100'000U);
}

// The rounding of one is no gain: the axis does not go into it.
TEST(Figure, DrawsAGainOfOneAsALine) {
  LabelledRun run{.label = "flat", .run = test::two_channel_run(20)};
  for (record::StoredPoint& point : run.run.responses.front().points) {
    point.response = point.dwell % 2 == 0 ? 1.0 : std::nextafter(1.0, 2.0);
    point.dof = 0.0;
  }
  std::ostringstream stream;
  write_bode_svg(stream, run, run.run.responses.front());
  EXPECT_EQ(occurrences(stream.str(), "10⁻"), 0U);
}

TEST(Figure, BecomesAPng) {
  if (!has_raster()) {
    EXPECT_THROW(png_from_svg(picture(10), 1.0), std::runtime_error);
    return;
  }
  const std::string png = png_from_svg(picture(10), 2.0);
  EXPECT_EQ(png.substr(1, 3), "PNG");
  EXPECT_THROW(png_from_svg("no picture", 1.0), std::runtime_error);
}

}  // namespace
}  // namespace sinerig::report
