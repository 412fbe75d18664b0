#include "realtime/loop_thread.h"

#include <csignal>
#include <pthread.h>
#include <utility>

#include "realtime/thread_rights.h"

namespace sinerig::realtime {

namespace {

// But for those that a thread raises by a fault of its own.
void leave_signals_to_others() {
  sigset_t set;
  sigfillset(&set);
  for (const int own : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGSYS, SIGTRAP})
    sigdelset(&set, own);
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
}

}  // namespace

LoopThread::LoopThread()
    : thread_{[this] {
        live({});
      }} {}

LoopThread::LoopThread(const Settings& settings) {
  process_.emplace();
  thread_ = std::thread{[this, settings] {
    live(settings);
  }};
  std::unique_lock lock{mutex_};
  changed_.wait(lock, [this] { return ready_; });
  grants_.insert(grants_.end(), process_->grants().begin(), process_->grants().end());
}

LoopThread::~LoopThread() {
  {
    const std::scoped_lock lock{mutex_};
    told_ = true;
  }
  changed_.notify_all();
  join();
}

void LoopThread::live(const std::optional<Settings>& settings) {
  pthread_setname_np(pthread_self(), "sinerig-loop");
  leave_signals_to_others();
  Grants grants;
  if (settings) grants = enter(*settings);
  std::unique_lock lock{mutex_};
  if (settings) grants_ = std::move(grants);
  ready_ = true;
  changed_.notify_all();
  changed_.wait(lock, [this] { return told_; });
  lock.unlock();
  if (!loop_) return;
  loop_();
  if (settings) leave();
  if (afterwards_) afterwards_();
}

void LoopThread::start(std::function<void()> loop, std::function<void()> afterwards) {
  {
    const std::scoped_lock lock{mutex_};
    loop_ = std::move(loop);
    afterwards_ = std::move(afterwards);
    told_ = true;
  }
  changed_.notify_all();
}

void LoopThread::join() {
  if (thread_.joinable()) thread_.join();
}

}  // namespace sinerig::realtime
