// The live page in a real browser: it follows a run to its end, its Stop button stops it, nothing
// complains. The run is in virtual time and goes on when the test says so.
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <mutex>
#include <numbers>

#include <gtest/gtest.h>

#include "dashboard/server.h"
#include "support/browser.h"
#include "support/served_run.h"

namespace sinerig::dashboard {
namespace {

constexpr std::uint32_t points = 30;

class RecordLog final : public RecordSink {
 public:
  void put(const Record& record) noexcept override { records.push_back(record); }
  void put_sample(const TickSamples& samples) noexcept override { records.push_back(samples); }
  bool flush() noexcept override { return true; }
  std::vector<Record> records;
};

class LivePage : public testing::Test {
 protected:
  void SetUp() override {
    const auto program = test::Browser::find();
    if (!program) GTEST_SKIP() << "no Chromium here (Debian: apt install chromium)";
    play();
    serve(live_, ":0");
    browser_ = std::make_unique<test::Browser>(*program);
  }

  void serve(LiveRun& run, const std::string& address) {
    server_.reset();
    server_ = std::make_unique<Server>(Server::Settings{.address = parse_address(address),
                                                        .token = random_token(),
                                                        .stop =
                                                            [this] {
                                                              ++stops_;
                                                            }},
                                       run);
  }

  LiveSetup setup() {
    LiveSetup setup = test::served_setup(plan_);
    setup.limits = limits_;
    setup.stop_requests = [this] {
      const std::scoped_lock lock{silence_};
      return stops_.load();
    };
    return setup;
  }

  bool wait_for_text(const std::string& id, const std::string& text) {
    return browser_->wait_until("document.getElementById('" + id + "').textContent === '" + text +
                                "'");
  }
  void press_stop() { browser_->evaluate("document.getElementById('stop').click()"); }

  explicit LivePage(SweepPlan plan = test::served_plan(points),
                    sim::SimulatedRigSettings rig = test::served_rig(),
                    GuardSettings limits = test::served_limits())
      : plan_{std::move(plan)}, rig_{std::move(rig)}, limits_{std::move(limits)} {}

  // The whole run, its records kept to be told bit by bit.
  void play() {
    VirtualClock clock{TickGrid{plan_.rate_hz}};
    sim::SimulatedRig rig{rig_, clock};
    Sensor* const sensors[] = {&rig.sensor(0)};
    Guard guard{test::served_limits(), clock.grid().period_s()};
    RunnerSettings settings;
    settings.record_samples = true;
    SweepRunner{plan_, settings, clock, rig.actuator(), sensors, guard, log_}.run(control_);
  }

  // Tells the page everything up to the point of dwell `dwell`.
  void tell_until(std::uint32_t dwell) {
    for (; told_ < log_.records.size(); ++told_) {
      const auto* point = std::get_if<Point>(&log_.records[told_]);
      if (point != nullptr && point->dwell == dwell) return;
      live_.take(log_.records[told_]);
    }
  }
  // … up to the first event of a kind, and all of the dwell that follows it but its point.
  void tell_until(EventKind kind) {
    for (; told_ < log_.records.size(); ++told_) {
      const auto* event = std::get_if<Event>(&log_.records[told_]);
      if (event != nullptr && event->kind == kind) return tell_until(event->dwell);
      live_.take(log_.records[told_]);
    }
  }
  void tell_all() {
    for (; told_ < log_.records.size(); ++told_) live_.take(log_.records[told_]);
  }

  void keep_picture(const std::string& save) {
    const char* folder = std::getenv("SINERIG_SCREENSHOTS");
    if (folder == nullptr) return;
    std::ofstream{std::string{folder} + "/" + save + ".png", std::ios::binary}
        << browser_->screenshot();
  }
  void expect_no_errors() { EXPECT_TRUE(browser_->errors().empty()) << browser_->errors().front(); }

  SweepPlan plan_;
  sim::SimulatedRigSettings rig_;
  GuardSettings limits_;  // that the page shows
  Lateness lateness_;
  RunControl control_;
  RecordLog log_;
  std::size_t told_ = 0;
  std::atomic<int> stops_{0};
  std::mutex silence_;  // while it is held the server tells nothing
  LiveRun live_{setup(), lateness_};
  std::unique_ptr<Server> server_;
  std::unique_ptr<test::Browser> browser_;
};

TEST_F(LivePage, FollowsARunToItsEnd) {
  lateness_.last_ns = 43'000;
  lateness_.max_ns = 210'000;
  browser_->open(server_->url(), 1440, 1000);
  EXPECT_TRUE(browser_->wait_until("!!document.querySelector('#gain svg')"));
  tell_until(12);
  EXPECT_TRUE(
      browser_->wait_until("document.getElementById('where').textContent.startsWith('13 of 30')"));
  EXPECT_TRUE(browser_->wait_until("!!document.querySelector('#gain [data-status=now]')"));
  EXPECT_TRUE(browser_->wait_until("!!document.querySelector('#lissajous .curve')"));
  EXPECT_TRUE(browser_->wait_until("document.querySelectorAll('#signal .curve').length === 3"));
  EXPECT_TRUE(browser_->wait_until("document.getElementById('late').textContent === '43.0 µs'"));
  EXPECT_EQ(browser_->evaluate("document.querySelectorAll('#guard tr').length"), 3);
  EXPECT_TRUE(
      browser_->wait_until("document.querySelector('#estimate').textContent.includes('±')"));
  EXPECT_TRUE(browser_->wait_until("document.querySelectorAll('.points tbody tr').length === 12"));
  keep_picture("live");
  browser_->prefer_dark(true);
  keep_picture("live-dark");
  browser_->prefer_dark(false);

  tell_all();
  live_.finish({.outcome = "done", .detail = "", .files = {"axis.sweep", "axis.html"}});
  EXPECT_TRUE(browser_->wait_until("document.getElementById('chip').textContent === 'done'"));
  EXPECT_EQ(browser_->evaluate("document.querySelectorAll('.points tbody tr').length"), points);
  EXPECT_TRUE(browser_->evaluate("document.getElementById('stop').hidden").get<bool>());
  EXPECT_NE(browser_->evaluate("document.getElementById('where').textContent")
                .get<std::string>()
                .find("wrote axis.sweep and axis.html"),
            std::string::npos);
  keep_picture("live-done");
  // The program may go: the page keeps what it has and asks no more.
  server_.reset();
  browser_->evaluate("document.querySelector('[data-switch=hz]:not([aria-pressed=true])').click()");
  EXPECT_FALSE(
      browser_->evaluate("document.getElementById('main').innerHTML.includes('NaN')").get<bool>());
  expect_no_errors();
}

TEST_F(LivePage, StopButtonStopsWithTheToken) {
  browser_->open(server_->url(), 900, 700);
  EXPECT_TRUE(browser_->wait_until("!!document.getElementById('stop')"));
  EXPECT_EQ(browser_->evaluate("location.hash"), "") << "the token stays in the address bar";
  browser_->evaluate("document.getElementById('stop').click()");
  EXPECT_TRUE(
      browser_->wait_until("document.getElementById('stop').textContent.startsWith('Stopping')"));
  browser_->evaluate("document.getElementById('stop').click()");
  EXPECT_TRUE(
      browser_->wait_until("performance.getEntriesByType('resource').filter(e => "
                           "e.name.endsWith('/stop')).length === 2"));
  EXPECT_EQ(stops_.load(), 2);
  live_.finish({.outcome = "interrupted", .detail = "stop requested", .files = {"axis.sweep"}});
  EXPECT_TRUE(browser_->wait_until(
      "document.getElementById('chip').textContent === 'interrupted: stop requested'"));
  expect_no_errors();
}

constexpr const char* stopping = "Stopping – press again for neutral at once";

TEST_F(LivePage, SaysThatItStopsOnlyWhereItDoes) {
  browser_->open(server_->url(), 900, 700);
  ASSERT_TRUE(browser_->wait_until("!!document.getElementById('stop')"));
  tell_until(2);
  EXPECT_TRUE(
      browser_->wait_until("document.getElementById('where').textContent.startsWith('3 of 30')"));
  // The first request is refused. Until then the page only says that it asks, and its stream has
  // left a connection for the request.
  browser_->evaluate(
      "EventSource.prototype.shut = EventSource.prototype.close;"
      "EventSource.prototype.close = function() { window.closed_first = true; this.shut(); };"
      "window.ask = window.fetch;"
      "window.fetch = (...all) => { window.fetch = window.ask;"
      "  window.seen = [document.getElementById('stop').textContent, window.closed_first,"
      "                 all[1].signal instanceof AbortSignal];"
      "  return Promise.resolve(new Response('No.', { status: 403 })); }; 0");
  press_stop();
  EXPECT_TRUE(wait_for_text("trouble", "Not stopped: No. Use Ctrl-C in the terminal."));
  EXPECT_EQ(browser_->evaluate("window.seen"), nlohmann::json({"Asking …", true, true}));
  EXPECT_TRUE(wait_for_text("stop", "Stop"));
  EXPECT_EQ(stops_.load(), 0);
  // The page goes on, and so does its button.
  tell_until(5);
  EXPECT_TRUE(
      browser_->wait_until("document.getElementById('where').textContent.startsWith('6 of 30')"));
  press_stop();
  EXPECT_TRUE(wait_for_text("stop", stopping));
  EXPECT_EQ(stops_.load(), 1);
  EXPECT_TRUE(wait_for_text("trouble", ""));
  tell_until(9);
  EXPECT_TRUE(
      browser_->wait_until("document.getElementById('where').textContent.startsWith('10 of 30')"));
  EXPECT_TRUE(browser_->wait_until("document.querySelectorAll('.points tbody tr').length === 9"));
  expect_no_errors();
}

// What the next press does is known to the program only: others stop the run, too.
TEST_F(LivePage, NamesOnItsButtonWhatAnyoneHasAskedFor) {
  browser_->open(server_->url(), 900, 700);
  ASSERT_TRUE(browser_->wait_until("!!document.getElementById('stop')"));
  EXPECT_TRUE(wait_for_text("stop", "Stop"));
  stops_ = 1;  // another watcher, or Ctrl-C
  EXPECT_TRUE(wait_for_text("stop", stopping));
  browser_->open("about:blank", 900, 700);
  browser_->open(server_->url(), 900, 700);
  ASSERT_TRUE(browser_->wait_until("!!document.getElementById('stop')"));
  EXPECT_TRUE(wait_for_text("stop", stopping));
  press_stop();
  EXPECT_TRUE(wait_for_text("stop", "Neutral at once"));
  expect_no_errors();
}

TEST_F(LivePage, NoticesThatNothingIsToldAnyMore) {
  browser_->open(server_->url(), 900, 700);
  ASSERT_TRUE(browser_->wait_until("!!document.getElementById('chip')"));
  EXPECT_TRUE(wait_for_text("chip", "running"));
  {
    const std::scoped_lock lock{silence_};
    EXPECT_TRUE(wait_for_text("chip", "no connection"));
    press_stop();
    EXPECT_TRUE(wait_for_text("trouble", "No answer within 3 s. Use Ctrl-C in the terminal."));
    EXPECT_TRUE(wait_for_text("stop", "Stop"));
  }
  EXPECT_TRUE(wait_for_text("chip", "running"));
}

// A run that is killed and resumed, or the next one, has the port of the one before.
TEST_F(LivePage, DoesNotMixTwoRuns) {
  browser_->open(server_->url(), 900, 700);
  tell_until(5);
  EXPECT_TRUE(browser_->wait_until("document.querySelectorAll('.points tbody tr').length === 5"));
  LiveSetup next = setup();
  next.label = "the next";
  LiveRun other{std::move(next), lateness_};
  const std::string place = server_->address().text();
  serve(other, place);
  EXPECT_TRUE(browser_->wait_until("document.querySelector('h1')?.textContent === 'the next'"));
  EXPECT_EQ(browser_->evaluate("document.querySelectorAll('.points tbody tr').length"), 0);
  // The token that it has was for the other run.
  EXPECT_TRUE(browser_->evaluate("document.getElementById('stop').disabled").get<bool>());
  // Its address with the right one, pasted over this page's, is no new page to the browser.
  browser_->evaluate("location.href = '" + server_->url() + "'; 0");
  EXPECT_TRUE(browser_->wait_until("document.getElementById('stop')?.disabled === false"));
  press_stop();
  EXPECT_TRUE(wait_for_text("stop", stopping));
  EXPECT_EQ(stops_.load(), 1);
  server_.reset();  // before what it tells of
}

TEST_F(LivePage, LeavesGapsWhereSamplesAreMissing) {
  for (Record& record : log_.records) {
    auto* samples = std::get_if<TickSamples>(&record);
    if (samples == nullptr || samples->tick % 100 >= 20) continue;
    for (const std::size_t channel : {command_channel, first_sensor_channel})
      samples->values[channel] = std::nan("");
  }
  browser_->open(server_->url(), 1440, 1000);
  tell_until(2);
  EXPECT_TRUE(browser_->wait_until("!!document.querySelector('#lissajous .curve')"));
  const auto pieces = [&](const std::string& selector) {
    return browser_
        ->evaluate("document.querySelector('" + selector +
                   "').getAttribute('d').split('M').length - 1")
        .get<int>();
  };
  EXPECT_GT(pieces("#lissajous .curve"), 1);
  EXPECT_GT(pieces("#signal .command"), 1);
  EXPECT_FALSE(
      browser_->evaluate("document.getElementById('now').innerHTML.includes('NaN')").get<bool>());
  expect_no_errors();
}

GuardSettings single_limits() {
  GuardSettings limits;
  limits.channels.resize(1);
  limits.channels[0].max = 2.0;
  limits.channels[0].velocity = {.soft = 900.0, .hard = 1000.0};
  limits.channels[0].following = {.hard = 3.0};
  limits.channels[0].following_ns = 100'000'000;
  return limits;
}

class SingleLimitsLivePage : public LivePage {
 protected:
  SingleLimitsLivePage()
      : LivePage{test::served_plan(points), test::served_rig(), single_limits()} {}
};

TEST_F(SingleLimitsLivePage, ShowsWhatIsLeftOfThem) {
  browser_->open(server_->url(), 1440, 1000);
  tell_until(5);
  EXPECT_TRUE(browser_->wait_until("document.querySelectorAll('#guard tr').length === 4"));
  const auto cell = [&](int row, int column) {
    return browser_
        ->evaluate("document.querySelectorAll('#guard tr')[" + std::to_string(row) + "].cells[" +
                   std::to_string(column) + "].textContent")
        .get<std::string>();
  };
  EXPECT_TRUE(cell(0, 2).ends_with(" left")) << cell(0, 2);
  EXPECT_EQ(cell(1, 0), "gyro velocity");
  EXPECT_TRUE(cell(1, 2).ends_with(" %")) << cell(1, 2);
  EXPECT_EQ(cell(2, 0), "gyro velocity, soft");
  EXPECT_EQ(cell(3, 3), "± 3.00 rad/s for 100 ms");
  EXPECT_EQ(cell(3, 2).find('%'), std::string::npos) << cell(3, 2);
  keep_picture("live-limits");
  expect_no_errors();
}

TEST_F(LivePage, WithoutATokenItOnlyWatches) {
  browser_->open("http://" + server_->address().text() + "/", 390, 800);
  EXPECT_TRUE(browser_->wait_until("!!document.getElementById('stop')"));
  EXPECT_TRUE(browser_->evaluate("document.getElementById('stop').disabled").get<bool>());
  tell_until(5);
  EXPECT_TRUE(browser_->wait_until("!!document.querySelector('#gain [data-status=now]')"));
  EXPECT_LE(browser_->evaluate("document.documentElement.scrollWidth").get<int>(), 390);
  keep_picture("live-narrow");
  expect_no_errors();
}

// A resonance between the points of a coarse plan, two tones a dwell.
SweepPlan coarse_plan() {
  SweepSettings sweep;
  sweep.start_hz = 2.0;
  sweep.stop_hz = 100.0;
  sweep.points = 6;
  sweep.tones = 2;
  sweep.refine_points = 3;
  sweep.amplitude = 0.4;
  return plan_sweep(sweep, {}, 1000.0);
}

sim::SimulatedRigSettings resonant_rig() {
  sim::SimulatedRigSettings rig = test::served_rig();
  const double omega = 2.0 * std::numbers::pi * 17.0;
  rig.system = sim::from_transfer_function({omega * omega}, {1.0, 0.3 * omega, omega * omega});
  return rig;
}

class CoarseLivePage : public LivePage {
 protected:
  CoarseLivePage() : LivePage{coarse_plan(), resonant_rig()} {}
};

TEST_F(CoarseLivePage, ShowsEveryToneAndNamesWhatRefinementAdds) {
  browser_->open(server_->url(), 1440, 1000);
  tell_until(0);
  EXPECT_TRUE(browser_->wait_until("document.querySelectorAll('#estimate tr').length === 2"));
  EXPECT_TRUE(
      browser_->wait_until("document.querySelector('#gain [data-status=now]')"
                           ".getAttribute('d').split('M').length - 1 === 2"));
  EXPECT_TRUE(browser_->wait_until(
      "document.getElementById('signal-note').textContent.endsWith('of the slowest tone')"));
  keep_picture("live-tones");
  tell_until(EventKind::refined);
  EXPECT_TRUE(browser_->wait_until(
      "document.getElementById('where').textContent.startsWith('refined dwell 1 beside the ')"));
  EXPECT_TRUE(browser_->wait_until(
      "document.getElementById('dwell-note').textContent.startsWith('refined dwell, ')"));
  EXPECT_TRUE(browser_->wait_until(
      "document.getElementById('last').textContent.includes('transient seen to go')"));
  EXPECT_EQ(browser_->evaluate("document.getElementById('left').textContent"),
            "as long as it takes");
  keep_picture("live-refined");
  expect_no_errors();
}

}  // namespace
}  // namespace sinerig::dashboard
