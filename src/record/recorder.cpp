#include "record/recorder.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace sinerig::record {

namespace {

// How often an idle recorder looks for work; short against a dwell, long against a wake-up.
constexpr std::chrono::milliseconds idle_interval{2};

// Samples and events that belong to no finished dwell yet are put on the disk this often.
constexpr std::chrono::seconds commit_interval{1};

}  // namespace

Recorder::Recorder(Outbox& outbox, SweepWriter& writer, Observer observer, Samples samples,
                   double tick_s)
    : outbox_{outbox},
      writer_{writer},
      observer_{std::move(observer)},
      samples_{samples},
      tick_s_{tick_s},
      thread_{[this] {
        drain();
      }} {}

Recorder::~Recorder() {
  if (thread_.joinable()) {
    outbox_.close();
    thread_.join();
  }
}

void Recorder::finish() {
  thread_.join();
  if (failure_) std::rethrow_exception(failure_);
}

void Recorder::drain() {
  try {
    Record record;
    auto next_commit = std::chrono::steady_clock::now() + commit_interval;
    while (true) {
      const bool last_look = outbox_.closed();
      if (outbox_.try_take(record)) {
        take_down(record);
      } else if (last_look) {
        break;
      } else {
        std::this_thread::sleep_for(idle_interval);
      }
      if (std::chrono::steady_clock::now() >= next_commit) {
        writer_.commit();
        next_commit += commit_interval;
      }
    }
    writer_.commit();
  } catch (...) {
    failure_ = std::current_exception();
    save_the_rest();
  }
}

void Recorder::take_down(const Record& record) {
  const auto taken = std::chrono::steady_clock::now();
  if (samples_ == Samples::written || !std::holds_alternative<TickSamples>(record)) {
    writer_.write(record);
  }
  if (const auto* timing = std::get_if<DwellTiming>(&record)) {
    end_dwell(*timing, std::chrono::steady_clock::now() - taken);
  } else if (std::holds_alternative<Point>(record)) {
    points_.push_back(record);
  } else if (observer_ && !std::holds_alternative<Lesson>(record)) {
    observer_(record);
  }
}

// Its points are on the disk now: the loop and whoever watches may know. The ticks since tell how
// long that took, but after the last dwell there are none.
void Recorder::end_dwell(const DwellTiming& timing, std::chrono::duration<double> writing) {
  const auto ticks = static_cast<double>(outbox_.acknowledge());
  if (tick_s_ > 0.0) writer_.note_lag(timing.dwell, std::max(ticks * tick_s_, writing.count()));
  if (observer_) {
    for (const Record& point : points_) observer_(point);
    observer_(timing);
  }
  points_.clear();
}

// The disk is full or gone. The loop is told to stop; what it still has to say of that is small and
// may find room.
void Recorder::save_the_rest() noexcept {
  outbox_.abandon();
  bool writing = writer_.rescue();
  Record record;
  while (true) {
    const bool last_look = outbox_.closed();
    if (outbox_.try_take(record)) {
      const bool bulky =
          std::holds_alternative<Block>(record) || std::holds_alternative<TickSamples>(record);
      if (bulky || !writing) continue;
      try {
        writer_.write(record);
      } catch (...) {
        writing = false;
      }
    } else if (last_look) {
      break;
    } else {
      std::this_thread::sleep_for(idle_interval);
    }
  }
  try {
    if (writing) writer_.commit();
  } catch (...) {
    // Nothing more can be done; what was on the disk before still is.
  }
}

}  // namespace sinerig::record
