// The thread beside the loop: takes records from the outbox and writes them down.
#pragma once

#include <exception>
#include <functional>
#include <thread>

#include "record/sweep_writer.h"
#include "sweep/outbox.h"

namespace sinerig::record {

class Recorder {
 public:
  // Called on the recorder's thread for every record, after it has been written. May not throw.
  using Observer = std::function<void(const Record&)>;

  // Whether samples go to the file, or to the observer only.
  enum class Samples { written, watched };

  // Starts the thread. `outbox` and `writer` must outlive it.
  Recorder(Outbox& outbox, SweepWriter& writer, Observer observer,
           Samples samples = Samples::written);

  // Joins; the outbox must have been closed or the recorder have failed.
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  // Waits until everything is written and throws what went wrong on the thread, a full disk say.
  void finish();

 private:
  void drain();

  Outbox& outbox_;
  SweepWriter& writer_;
  Observer observer_;
  Samples samples_;
  std::exception_ptr failure_;
  std::thread thread_;
};

}  // namespace sinerig::record
