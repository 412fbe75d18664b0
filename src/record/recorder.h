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
  // Called on the recorder's thread for every record, after it has been written.
  using Observer = std::function<void(const Record&)>;

  // Starts the thread. `outbox` and `writer` must outlive it.
  Recorder(Outbox& outbox, SweepWriter& writer, Observer observer);

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
  std::exception_ptr failure_;
  std::thread thread_;
};

}  // namespace sinerig::record
