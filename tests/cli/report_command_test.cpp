#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/program.h"

namespace sinerig {
namespace {

using testing::HasSubstr;

constexpr const char* short_rig = R"([loop]
rate_hz = 500
[sweep]
start_hz = 2
stop_hz = 40
points = 6
amplitude = 0.1
settle_s = 0.1
[limits]
[actuator]
driver = "sim"
[sensor.position]
driver = "sim"
noise_rms = 1e-3
[plant]
kind = "transfer_function"
num = [100.0]
den = [1.0, 100.0]
)";

class ReportCommand : public testing::Test {
 protected:
  void SetUp() override { workshop_.write("axis.toml", short_rig); }
  test::Workshop workshop_;
};

TEST_F(ReportCommand, RunLeavesAReportAndSaysWhere) {
  const auto run = workshop_.sinerig("run axis.toml");
  EXPECT_EQ(run.exit_code, 0) << run.errors;
  EXPECT_THAT(run.errors, HasSubstr("wrote axis.html"));
  EXPECT_THAT(workshop_.read("axis.html"), HasSubstr("<title>axis – sinerig</title>"));
}

// White noise of 1e-3 on a sine of 0.1 behind a gain near 1: SNR 37 dB per sample, and over one
// cycle of some 250 samples a coherence that lacks 1e-6 or so.
TEST_F(ReportCommand, ShowReportAndExportsGiveTheCoherence) {
  workshop_.sinerig("run axis.toml");
  const auto show = workshop_.sinerig("show axis.sweep");
  EXPECT_THAT(show.output, HasSubstr("SNR dB coherence"));
  EXPECT_THAT(show.output, HasSubstr(" 0.9999"));
  EXPECT_THAT(workshop_.read("axis.html"), HasSubstr("\"coherence\":[0.9999"));
  EXPECT_THAT(workshop_.sinerig("export axis.sweep --format json").output,
              HasSubstr("\"coherence\": 0.9999"));
  EXPECT_THAT(workshop_.sinerig("export axis.sweep").output, HasSubstr(",snr_db,coherence,"));
  EXPECT_THAT(workshop_.sinerig("run axis.toml --json -o again.sweep").output,
              HasSubstr("\"coherence\":0.9999"));
}

TEST_F(ReportCommand, RunWritesNoneWhenToldSo) {
  EXPECT_EQ(workshop_.sinerig("run axis.toml --no-report").exit_code, 0);
  EXPECT_TRUE(workshop_.has("axis.sweep"));
  EXPECT_FALSE(workshop_.has("axis.html"));
}

TEST_F(ReportCommand, RunLeavesAForeignPageAloneAndStillSucceeds) {
  workshop_.write("axis.html", "my notes");
  const auto run = workshop_.sinerig("run axis.toml");
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.errors, HasSubstr("no report: axis.html: exists already"));
  EXPECT_EQ(workshop_.read("axis.html"), "my notes");
}

TEST_F(ReportCommand, ReplacesItsOwnReportOnly) {
  workshop_.sinerig("run axis.toml");
  EXPECT_EQ(workshop_.sinerig("report axis.sweep").exit_code, 0);
  workshop_.write("axis.html", "my notes");
  EXPECT_EQ(workshop_.sinerig("report axis.sweep").exit_code, 2);
  EXPECT_EQ(workshop_.sinerig("report axis.sweep --force").exit_code, 0);
}

TEST_F(ReportCommand, DrawsAPicture) {
  workshop_.sinerig("run axis.toml --no-report");
  EXPECT_EQ(workshop_.sinerig("report axis.sweep --format svg -o plot.svg").exit_code, 0);
  EXPECT_THAT(workshop_.read("plot.svg"), testing::StartsWith("<svg "));
  const auto png = workshop_.sinerig("report axis.sweep --format png");
  EXPECT_EQ(png.exit_code == 0, workshop_.has("axis.png"));
  const auto unknown = workshop_.sinerig("report axis.sweep --format svg --channel nose --force");
  EXPECT_EQ(unknown.exit_code, 1);
  EXPECT_THAT(unknown.errors, HasSubstr("has no response of \"nose\"; it has position"));
}

// Names of files are bytes: neither UTF-8 nor printable, if their owner likes.
TEST_F(ReportCommand, TakesFilesOfAnyName) {
  const std::string latin = "caf\xe9.csv";
  const std::string control = "x\x01.csv";
  for (const std::string& name : {latin, control})
    workshop_.write(name, "1,1,0\n2,0.9,-0.1\n4,0.7,-0.3\n8,0.4,-0.4\n");
  const auto compared = workshop_.sinerig("compare " + latin + " " + control + " --json");
  EXPECT_EQ(compared.exit_code, 0) << compared.errors;
  EXPECT_THAT(compared.output, HasSubstr("\"reference\": \"caf\uFFFD\""));
  for (const std::string& name : {latin, control}) {
    EXPECT_EQ(workshop_.sinerig("report " + name).exit_code, 0);
    EXPECT_EQ(workshop_.sinerig("report " + name + " --format svg").exit_code, 0);
    const auto png = workshop_.sinerig("report " + name + " --format png");
    EXPECT_THAT(png.errors, testing::Not(HasSubstr("XML")));
  }
}

}  // namespace
}  // namespace sinerig
