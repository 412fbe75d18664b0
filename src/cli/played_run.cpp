#include "cli/played_run.h"

#include <atomic>
#include <mutex>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "report/remaining_time.h"

namespace sinerig::cli {

namespace {

constexpr std::chrono::milliseconds progress_interval{50};

// Points on their way from the recorder's thread to the one that prints.
class PointInbox {
 public:
  void put(const Record& record) {
    if (const auto* point = std::get_if<Point>(&record)) {
      const std::scoped_lock lock{mutex_};
      points_.push_back(*point);
    }
  }
  std::vector<Point> take() {
    const std::scoped_lock lock{mutex_};
    return std::exchange(points_, {});
  }

 private:
  std::mutex mutex_;
  std::vector<Point> points_;
};

// Whatever happens to those who watch: the loop ends, neutral, before what it works on is gone.
class EndOfLoop {
 public:
  EndOfLoop(realtime::LoopThread& loop, RunControl& control) : loop_{loop}, control_{control} {}
  ~EndOfLoop() {
    control_.stop_requests.store(2);
    loop_.join();
  }
  EndOfLoop(const EndOfLoop&) = delete;
  EndOfLoop& operator=(const EndOfLoop&) = delete;

 private:
  realtime::LoopThread& loop_;
  RunControl& control_;
};

}  // namespace

Played play(const SweepPlan& plan, realtime::LoopThread& loop, SweepRunner& runner,
            RunControl& control, Outbox& outbox, record::SweepWriter& writer,
            const Audience& audience) {
  PointInbox inbox;
  report::RemainingTime time{plan};
  audience.service.ready();
  const auto observe = [&](const Record& record) {
    inbox.put(record);
    if (audience.view != nullptr) audience.view->run().take(record);
  };
  record::Recorder recorder{outbox, writer, observe, audience.samples, audience.tick_s};
  Played played;
  std::atomic<bool> ended{false};
  loop.start(
      [&] {
        played.outcome = runner.run(control);
        ended.store(true);
      },
      [&] { outbox.close(); });
  const EndOfLoop end_of_loop{loop, control};
  const auto tell = [&] {
    for (const Point& point : inbox.take()) audience.teller.point(point);
    audience.teller.update(control.dwell.load(), control.tick.load());
  };
  const auto tell_service = [&] {
    const std::uint32_t dwell = control.dwell.load();
    const std::uint64_t tick = control.tick.load();
    audience.service.progress(control.progress(), std::chrono::steady_clock::now());
    time.update(dwell, tick);
    audience.service.status(status_text(plan, dwell, time));
  };
  while (!ended.load()) {
    tell();
    tell_service();
    std::this_thread::sleep_for(progress_interval);
  }
  tell_service();
  audience.at_rest();
  // Neutral, and no tick any more: the disk has the time that the rig gives it, and a little.
  const auto patience =
      std::chrono::duration_cast<std::chrono::nanoseconds>(audience.disk_patience);
  try {
    attended(audience.service, for_at_most(patience + most_desk_work), [&] {
      loop.join();
      recorder.finish();
    });
  } catch (const record::SweepFileError& error) {
    played.disk_failure = error.what();
  }
  tell();
  audience.teller.close();
  return played;
}

}  // namespace sinerig::cli
