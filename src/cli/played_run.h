// The loop of a run on its own thread, the recorder beside it, its story told meanwhile.
#pragma once

#include <chrono>
#include <functional>
#include <string>

#include "cli/live_view.h"
#include "cli/run_teller.h"
#include "cli/service_notifier.h"
#include "realtime/loop_thread.h"
#include "record/recorder.h"
#include "record/sweep_writer.h"
#include "sweep/outbox.h"
#include "sweep/runner.h"

namespace sinerig::cli {

// Beside the loop: a prior fitted, a file made, a report written. A large one takes a minute.
inline constexpr std::chrono::minutes most_desk_work{10};

// Who hears of a run: the terminal, a script, the live page. Each may be absent.
struct Audience {
  RunTeller& teller;
  ServiceNotifier& service;
  std::function<void()> at_rest;  // the loop has ended, its last points are still to be written
  LiveView* view;
  record::Recorder::Samples samples;
  double tick_s;                                // of a loop in real time; 0 in virtual time
  std::chrono::duration<double> disk_patience;  // [output] max_lag_s
};

struct Played {
  RunOutcome outcome;
  std::string disk_failure;  // empty: everything is on the disk
};

// The loop on its own thread, its story told on this one, until both the loop and the recorder are
// done.
Played play(const SweepPlan& plan, realtime::LoopThread& loop, SweepRunner& runner,
            RunControl& control, Outbox& outbox, record::SweepWriter& writer,
            const Audience& audience);

}  // namespace sinerig::cli
