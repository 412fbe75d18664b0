// The thread beside the loop: takes records from the outbox and writes them down.
#pragma once

#include <chrono>
#include <exception>
#include <functional>
#include <thread>
#include <vector>

#include "record/sweep_writer.h"
#include "sweep/outbox.h"

namespace sinerig::record {

class Recorder {
 public:
  // Called on the recorder's thread for every record but lessons, after it has been written; for
  // points and timing after they are on the disk. May not throw.
  using Observer = std::function<void(const Record&)>;

  // Whether samples go to the file, or to the observer only.
  enum class Samples { written, watched };

  // Starts the thread. `outbox` and `writer` must outlive it. With the seconds of a tick of a loop
  // in real time it keeps how far the disk is behind the loop, too.
  Recorder(Outbox& outbox, SweepWriter& writer, Observer observer,
           Samples samples = Samples::written, double tick_s = 0.0);

  // Joins; the outbox must have been closed or the recorder have failed.
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  // Waits until everything is written and throws what went wrong on the thread, a full disk say.
  // What could still be saved then has been.
  void finish();

 private:
  void drain();
  void take_down(const Record& record);
  void end_dwell(const DwellTiming& timing, std::chrono::duration<double> writing);
  void save_the_rest() noexcept;

  Outbox& outbox_;
  SweepWriter& writer_;
  Observer observer_;
  Samples samples_;
  double tick_s_;
  std::vector<Record> points_;  // of the dwell that is ending
  std::exception_ptr failure_;
  std::thread thread_;
};

}  // namespace sinerig::record
