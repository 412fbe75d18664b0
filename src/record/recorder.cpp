#include "record/recorder.h"

#include <chrono>
#include <utility>

namespace sinerig::record {

namespace {

// How often an idle recorder looks for work; short against a dwell, long against a wake-up.
constexpr std::chrono::milliseconds idle_interval{2};

// Samples and events that belong to no finished dwell yet are put on the disk this often.
constexpr std::chrono::seconds commit_interval{1};

}  // namespace

Recorder::Recorder(Outbox& outbox, SweepWriter& writer, Observer observer, Samples samples)
    : outbox_{outbox},
      writer_{writer},
      observer_{std::move(observer)},
      samples_{samples},
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
        if (samples_ == Samples::written || !std::holds_alternative<TickSamples>(record))
          writer_.write(record);
        if (observer_) observer_(record);
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
    outbox_.abandon();
  }
}

}  // namespace sinerig::record
