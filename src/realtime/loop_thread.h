// The thread of a loop in real time. It asks for its rights before there is anything to do: what
// was refused is known before a rig is opened, and what was granted is what the loop will have.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "realtime/process_rights.h"

namespace sinerig::realtime {

class LoopThread {
 public:
  // An ordinary thread: for virtual time, where the machine does not matter. No grants.
  LoopThread();

  // Returns once the thread waits with all that it was granted. Signals go to other threads.
  explicit LoopThread(const Settings& settings);

  // Ends a thread that was never started; waits for one that was.
  ~LoopThread();
  LoopThread(const LoopThread&) = delete;
  LoopThread& operator=(const LoopThread&) = delete;

  // Of the process and of the thread, in the order in which they were asked for.
  const Grants& grants() const { return grants_; }

  // Once. `loop` with the rights; `afterwards`, when it is through, without the priority: it may
  // wait for ordinary threads. Neither may throw.
  void start(std::function<void()> loop, std::function<void()> afterwards);
  void join();  // idempotent

 private:
  void live(const std::optional<Settings>& settings);

  std::optional<ProcessRights> process_;
  Grants grants_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool ready_ = false;
  bool told_ = false;  // to start, or to end
  std::function<void()> loop_;
  std::function<void()> afterwards_;
  std::thread thread_;
};

}  // namespace sinerig::realtime
