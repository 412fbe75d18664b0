#include "cli/stop_on_signal.h"

#include <atomic>

namespace sinerig::cli {

namespace {

// Set by the signal handler's owners, read in the handler.
std::atomic<StopOnSignal*> innermost{nullptr};

void raise_to(std::atomic<int>& count, int least) {
  int now = count.load();
  while (now < least && !count.compare_exchange_weak(now, least)) {
  }
}

}  // namespace

void StopOnSignal::count_stop_request(int signal) {
  const int requests = signal == SIGQUIT ? 2 : 1;
  for (const StopOnSignal* each = innermost.load(); each != nullptr; each = each->outer_) {
    each->control_.stop_requests.fetch_add(requests);
  }
}

StopOnSignal::StopOnSignal(RunControl& control) : control_{control}, outer_{innermost.load()} {
  innermost = this;
  struct sigaction action {};
  action.sa_handler = count_stop_request;
  for (std::size_t i = 0; i < stopping.size(); ++i) {
    sigaction(stopping[i], nullptr, &old_stopping_[i]);
    const bool unheard = old_stopping_[i].sa_handler == SIG_IGN && stopping[i] != SIGTERM;
    if (!unheard) sigaction(stopping[i], &action, nullptr);
  }
  action.sa_handler = SIG_IGN;
  for (std::size_t i = 0; i < ignored.size(); ++i) {
    sigaction(ignored[i], &action, &old_ignored_[i]);
  }
  if (outer_ != nullptr) {
    raise_to(control.stop_requests, outer_->control_.stop_requests.load());
  }
}

StopOnSignal::~StopOnSignal() {
  for (std::size_t i = 0; i < stopping.size(); ++i) {
    sigaction(stopping[i], &old_stopping_[i], nullptr);
  }
  for (std::size_t i = 0; i < ignored.size(); ++i) {
    sigaction(ignored[i], &old_ignored_[i], nullptr);
  }
  innermost = outer_;
}

}  // namespace sinerig::cli
