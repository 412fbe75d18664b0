// The report in a real browser: it renders, its switches and cursors work, nothing complains.
#include <complex>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>

#include <gtest/gtest.h>

#include "report/html.h"
#include "support/browser.h"
#include "support/program.h"
#include "support/stored_runs.h"

namespace sinerig::report {
namespace {

class Page : public testing::Test {
 protected:
  void SetUp() override {
    const auto program = test::Browser::find();
    if (!program) GTEST_SKIP() << "no Chromium here (Debian: apt install chromium)";
    browser_ = std::make_unique<test::Browser>(*program);
  }

  void TearDown() override {
    if (!path_.empty()) std::filesystem::remove(path_);
  }

  // `save` names a picture that is kept in $SINERIG_SCREENSHOTS, for people to look at.
  void keep_picture(const std::string& save) {
    const char* folder = std::getenv("SINERIG_SCREENSHOTS");
    if (folder == nullptr) return;
    std::ofstream{std::string{folder} + "/" + save + ".png", std::ios::binary}
        << browser_->screenshot();
  }

  void show(const LabelledRun& run, int width = 1440, int height = 900) {
    write([&](std::ostream& stream) { write_html(stream, run); });
    browser_->open("file://" + path_, width, height);
  }

  template <typename Writer>
  void write(Writer writer) {
    path_ = (std::filesystem::temp_directory_path() /
             ("sinerig-page-" + std::to_string(getpid()) + ".html"))
                .string();
    std::ofstream stream{path_};
    writer(stream);
  }

  std::string text(const std::string& selector) {
    return browser_->evaluate("document.querySelector('" + selector + "').textContent");
  }

  void press(const std::string& label) {
    browser_->evaluate(
        "[...document.querySelectorAll('#bar button')].find(b => b.textContent === '" + label +
        "').click()");
  }

  // A place in the plot: parts of its width and height, in pixels of the window.
  std::pair<double, double> place(const std::string& id, double x, double y) {
    const auto box =
        browser_->evaluate("(r => [r.left, r.top, r.width, r.height])(document.getElementById('" +
                           id + "').getBoundingClientRect())");
    return {box[0].get<double>() + x * box[2].get<double>(),
            box[1].get<double>() + y * box[3].get<double>()};
  }

  void expect_no_errors() { EXPECT_TRUE(browser_->errors().empty()) << browser_->errors().front(); }

  std::unique_ptr<test::Browser> browser_;
  std::string path_;
};

LabelledRun run_of(std::size_t points) {
  return {.label = "axis", .run = test::two_channel_run(points)};
}

TEST_F(Page, DrawsEveryPlotWithoutAnError) {
  show(run_of(40));
  for (const char* id : {"gain", "phase", "nyquist", "gain95", "phase95", "snr", "coherence",
                         "amplitude", "response", "lateness", "histogram", "faults", "switches"}) {
    const std::string inside = "!!document.querySelector('#" + std::string{id} + " svg path')";
    EXPECT_TRUE(browser_->evaluate(inside).get<bool>()) << id;
  }
  EXPECT_EQ(text("h1"), "axis");
  EXPECT_FALSE(
      browser_->evaluate("document.getElementById('main').innerHTML.includes('NaN')").get<bool>());
  EXPECT_FALSE(browser_->evaluate("document.body.innerText.includes('undefined')").get<bool>());
  EXPECT_TRUE(
      browser_->evaluate("document.querySelector('pre').textContent.includes('<fast> & ')"));
  keep_picture("report");
  expect_no_errors();
}

TEST_F(Page, MarksPointsByStatus) {
  show(run_of(40));
  const auto shown = browser_->evaluate(
      "[...document.querySelectorAll('#gain [data-status]')].map(m => m.dataset.status).sort()");
  EXPECT_EQ(shown,
            nlohmann::json({"clipped", "distorted", "good", "low_signal", "rt_fault", "stopped"}));
  EXPECT_NE(text("#bode .legend").find("low signal"), std::string::npos);
}

TEST_F(Page, SwitchesUnits) {
  show(run_of(41));
  const auto [x, y] = place("gain", 0.53, 0.5);
  browser_->move_mouse(x, y);
  // The 21st of 41 points from 1 to 100 Hz is the corner of the lag: 2/√2, −45°.
  EXPECT_EQ(text(".readout .at"), "10.0000 Hz");
  EXPECT_EQ(text("[data-value=gain]").substr(0, 5), "3.010");
  EXPECT_EQ(text("[data-value=phase]").substr(0, 8), "−45.00");
  press("rad/s");
  EXPECT_EQ(text(".readout .at"), "62.8319 rad/s");
  press("absolute");
  EXPECT_EQ(text("[data-value=gain]").substr(0, 6), "1.4142");
  EXPECT_NE(text("#bode h3").find("times 1 rad/Nm"), std::string::npos);
  press("radians");
  EXPECT_EQ(text("[data-value=phase]").substr(0, 9), "−0.7854");
  EXPECT_NE(text("#phase svg").find("π"), std::string::npos);
  press("wrapped");
  expect_no_errors();
}

TEST_F(Page, ShowsSeveralChannels) {
  show(run_of(30));
  EXPECT_EQ(browser_->evaluate("document.querySelectorAll('#gain .curve').length"), 1);
  press("gyro");
  EXPECT_EQ(browser_->evaluate("document.querySelectorAll('#gain .curve').length"), 2);
  press("encoder");
  EXPECT_EQ(browser_->evaluate("document.querySelectorAll('#gain .curve').length"), 1);
  EXPECT_NE(text("#bode h3").find("(rad/s)/Nm"), std::string::npos);
  expect_no_errors();
}

TEST_F(Page, LinksTheCursorOfAllPlots) {
  show(run_of(40));
  const auto [x, y] = place("phase", 0.5, 0.5);
  browser_->move_mouse(x, y);
  const auto lines = browser_->evaluate(
      "['gain', 'phase', 'snr', 'lateness'].map(id => document.querySelector(`#${id} .over path`) "
      "!== null)");
  EXPECT_EQ(lines, nlohmann::json({true, true, true, true}));
  EXPECT_EQ(browser_->evaluate("document.querySelectorAll('#nyquist .spot').length"), 1);
  EXPECT_EQ(browser_->evaluate("document.querySelectorAll('.points tr.at').length"), 1);
  browser_->click(x, y);
  browser_->move_mouse(5, 5);
  EXPECT_NE(text(".readout .at").find("kept"), std::string::npos);
  const std::string before = text(".readout .at");
  browser_->press_key("ArrowRight");
  EXPECT_NE(text(".readout .at"), before);
  browser_->press_key("Escape");
  EXPECT_EQ(text(".readout .at"), "point at a plot");
  expect_no_errors();
}

TEST_F(Page, ZoomsAllPlotsByADrag) {
  show(run_of(60));
  const auto labels = "[...document.querySelectorAll('#snr text')].map(t => t.textContent).join()";
  const auto whole = browser_->evaluate(labels);
  const auto [x0, y0] = place("gain", 0.4, 0.5);
  const auto [x1, y1] = place("gain", 0.6, 0.5);
  browser_->drag(x0, y0, x1, y1);
  EXPECT_NE(browser_->evaluate(labels), whole);
  keep_picture("zoomed");
  browser_->double_click(x0, y0);
  EXPECT_EQ(browser_->evaluate(labels), whole);
  browser_->drag(x0, y0, x1, y1);
  press("whole range");
  EXPECT_EQ(browser_->evaluate(labels), whole);
  expect_no_errors();
}

TEST_F(Page, IsLightAndDark) {
  browser_->prefer_dark(true);
  show(run_of(20));
  const auto paper = "getComputedStyle(document.documentElement).backgroundColor";
  const auto dark = browser_->evaluate(paper);
  keep_picture("dark");
  press("light / dark");
  EXPECT_NE(browser_->evaluate(paper), dark);
  browser_->prefer_dark(false);
  press("light / dark");
  EXPECT_EQ(browser_->evaluate(paper), dark);
  expect_no_errors();
}

TEST_F(Page, ShowsAModelWithItsResidual) {
  LabelledRun run = run_of(40);
  run.run.fits = {test::lag_fit()};
  show(run);
  EXPECT_EQ(browser_->evaluate("document.querySelectorAll('#gain .model').length"), 1);
  // The model is exact: every residual sits on zero, inside its interval.
  EXPECT_EQ(
      browser_->evaluate("document.querySelector('#residual-gain .outside').getAttribute('d')"),
      "");
  EXPECT_TRUE(browser_->evaluate("!!document.querySelector('#poles-0 svg')").get<bool>());
  // A scale needs two labels at least.
  EXPECT_GE(browser_
                ->evaluate("document.querySelectorAll('#residual-gain text[text-anchor=end]')"
                           ".length - 1")
                .get<int>(),
            2);
  keep_picture("model");
  expect_no_errors();
}

// A real run, fitted by the program, with a controller.
TEST_F(Page, ShowsTheLoopWithItsMarginsAndTheNotch) {
  const test::Workshop workshop;
  ASSERT_EQ(workshop.sinerig("run " SINERIG_SOURCE_DIR "/config/gimbal.toml --quiet --no-report")
                .exit_code,
            0);
  const auto report = workshop.sinerig("report gimbal.sweep --pid 3,3,0.15,10");
  ASSERT_EQ(report.exit_code, 0) << report.errors;
  browser_->open("file://" + (workshop.folder() / "gimbal.html").string(), 1440, 2900);
  EXPECT_EQ(browser_->evaluate("document.querySelectorAll('#loop-gain .curve').length"), 2);
  const auto cell = [&](int row, int column) {
    return browser_
        ->evaluate("document.querySelector('#margins table tbody').rows[" + std::to_string(row) +
                   "].cells[" + std::to_string(column) + "].textContent")
        .get<std::string>();
  };
  // Gain margin of the model, 15.0 dB, and with the notch, more of it.
  EXPECT_EQ(cell(0, 1).substr(0, 2), "15") << cell(0, 1);
  EXPECT_GT(std::stod(cell(0, 3)), 20.0) << cell(0, 3);
  EXPECT_EQ(cell(6, 1), "stable");
  EXPECT_NE(text("#tables").find("Proposed notch"), std::string::npos);
  keep_picture("loop");
  press("rad/s");
  expect_no_errors();
}

// atan2 of 0.6 k and 0.8 k is the same angle up to a unit in the last place.
TEST_F(Page, DrawsAPhaseThatIsConstantUpToRounding) {
  LabelledRun run = run_of(30);
  for (record::StoredPoint& point : run.run.responses.front().points) {
    point.response = (1.0 + point.dwell) * std::complex<double>{0.6, 0.8};
    point.dof = 0.0;  // without an interval
  }
  show(run);
  EXPECT_LT(browser_->evaluate("document.querySelectorAll('#phase text').length").get<int>(), 100);
  expect_no_errors();
}

// Without a least span the axis of a gain of one went from −8e-9 to 8e-9 dB, and drew the rounding.
TEST_F(Page, DrawsAGainOfOneAsALine) {
  LabelledRun run = run_of(30);
  for (record::StoredPoint& point : run.run.responses.front().points) {
    point.response = point.dwell % 2 == 0 ? 1.0 : std::nextafter(1.0, 2.0);
    point.dof = 0.0;
  }
  show(run);
  const auto highest_label = [&](const std::string& id) {
    return browser_->evaluate("Math.max(...[...document.querySelectorAll('#" + id +
                              " svg text')].filter(t => t.getAttribute('text-anchor') === 'end')"
                              ".map(t => parseFloat(t.textContent)).filter(Number.isFinite))");
  };
  EXPECT_EQ(highest_label("gain"), 4e-4);
  EXPECT_EQ(highest_label("phase"), 4e-4);
  press("absolute");
  EXPECT_GT(highest_label("gain").get<double>(), 1.0);
  expect_no_errors();
}

// Where the phase jumps a turn the band of its interval ends and begins anew, as the curve does.
TEST_F(Page, SplitsTheBandOfAWrappedPhase) {
  LabelledRun run = run_of(40);
  for (record::StoredPoint& point : run.run.responses.front().points)
    point.response = std::polar(std::abs(point.response), -0.4 * point.dwell);
  run.run.fits = {test::lag_fit()};
  run.run.fits.front().delay_s = 0.02;
  show(run);
  // The highest step between neighbours along the bands, as a part of the plot's height.
  const std::string highest_step =
      "(h => Math.max(...[...document.querySelectorAll('#phase .band')].flatMap(band =>"
      " band.getAttribute('d').split('Z').flatMap(piece => {"
      " const ys = piece.split(/[ML]/).slice(1).map(p => +p.split(' ')[1]);"
      " return ys.slice(1).map((y, i) => Math.abs(y - ys[i]) / h); }))))"
      "(document.querySelector('#phase .frame').getBBox().height)";
  const std::string bands =
      "[...document.querySelectorAll('#phase .band')].map(b => "
      "b.getAttribute('d').split('M').length"
      " - 1)";
  EXPECT_EQ(browser_->evaluate(bands), nlohmann::json::array({1}));
  press("wrapped");
  EXPECT_LT(browser_->evaluate(highest_step).get<double>(), 0.5);
  for (const auto& pieces : browser_->evaluate(bands)) EXPECT_GE(pieces.get<int>(), 2);
  expect_no_errors();
}

TEST_F(Page, FitsANarrowWindow) {
  show(run_of(40), 390, 800);
  EXPECT_LE(browser_->evaluate("document.documentElement.scrollWidth").get<int>(), 390)
      << browser_->evaluate(
             "[...document.querySelectorAll('body *')].filter(e => "
             "e.getBoundingClientRect().right > 391 && !e.closest('.scroll, pre'))"
             ".slice(0, 9).map(e => e.tagName + '.' + e.className)");
  keep_picture("narrow");
  expect_no_errors();
}

TEST_F(Page, SurvivesARunWithoutPoints) {
  LabelledRun run{.label = "empty", .run = {}};
  run.run.facts = {{"outcome", "stopped"}, {"outcome_detail", "encoder above its limit"}};
  show(run);
  EXPECT_NE(text("main").find("No point was finished"), std::string::npos);
  show(run_of(1));
  expect_no_errors();
}

// As after a power cut: nothing in the file says how it ended.
TEST_F(Page, SaysThatARunWasNotFinished) {
  LabelledRun run = run_of(12);
  run.run.facts.erase("outcome");
  run.run.responses.front().points.resize(7);
  show(run);
  EXPECT_EQ(text(".outcome"), "not finished");
  EXPECT_TRUE(browser_->evaluate("document.querySelector('.outcome').classList.contains('bad')")
                  .get<bool>());
  EXPECT_NE(text(".facts").find("of 12 planned"), std::string::npos) << text(".facts");
  // An import is no run: it has not been cut short.
  run.run.facts["imported_from"] = "bench.csv";
  show(run);
  EXPECT_TRUE(browser_->evaluate("!document.querySelector('.outcome')").get<bool>());
  expect_no_errors();
}

TEST_F(Page, HoldsFiveHundredPointsInUnderAMegabyte) {
  show(run_of(500));
  EXPECT_LT(std::filesystem::file_size(path_), 1'000'000U);
  const double opened_ms =
      browser_->evaluate("performance.getEntriesByType('navigation')[0].loadEventStart");
  RecordProperty("opened_ms", std::to_string(opened_ms));
  EXPECT_GT(opened_ms, 0.0);
  expect_no_errors();
}

}  // namespace
}  // namespace sinerig::report
