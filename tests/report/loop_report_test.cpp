#include "report/loop_report.h"

#include <sstream>

#include <gmock/gmock.h>

namespace sinerig::report {
namespace {

using testing::HasSubstr;

std::string printed(const identify::LoopFigures& figures) {
  std::ostringstream stream;
  print_loop(stream, "model", figures, true);
  return stream.str();
}

// A fit of far too many poles knew a gain margin to 500 000 dB, and said so.
TEST(LoopReport, SaysNotKnownForAnIntervalThatSaysNothing) {
  identify::LoopFigures figures;
  figures.gain_margin.emplace();
  figures.gain_margin->margin_db = {30.507, -5.1943e5, 5.195e5};
  figures.bandwidth_hz = {1.5943, 1.3657e-5, 1.8613e5};
  figures.sensitivity_peak.peak = {1.819, 1.819, 1.819};  // without scatter
  const std::string text = printed(figures);
  EXPECT_THAT(text, HasSubstr("30.507  (interval not known)"));
  EXPECT_THAT(text, HasSubstr("1.5943  (interval not known)"));
  EXPECT_THAT(text, HasSubstr("1.819  (interval not known)"));
}

// A gain of nearly one is known well where the interval is wider than its few tenths of a dB.
TEST(LoopReport, TellsTheIntervalOfAFigureNearZero) {
  identify::LoopFigures figures;
  figures.gain_margin.emplace();
  figures.gain_margin->margin_db = {0.2, -0.5, 0.9};
  figures.bandwidth_hz = {1.5, 1.2, 1.9};
  const std::string text = printed(figures);
  EXPECT_THAT(text, HasSubstr("0.2  (-0.5 to 0.9)"));
  EXPECT_THAT(text, HasSubstr("1.5  (1.2 to 1.9)"));
}

}  // namespace
}  // namespace sinerig::report
