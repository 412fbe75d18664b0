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

void StopOnSignal::count_stop_request(int /*signal*/) {
  for (const StopOnSignal* each = innermost.load(); each != nullptr; each = each->outer_) {
    each->control_.stop_requests.fetch_add(1);
  }
}

StopOnSignal::StopOnSignal(RunControl& control) : control_{control}, outer_{innermost.load()} {
  innermost = this;
  struct sigaction action {};
  action.sa_handler = count_stop_request;
  sigaction(SIGINT, &action, &old_int_);
  sigaction(SIGTERM, &action, &old_term_);
  sigaction(SIGHUP, &action, &old_hup_);
  action.sa_handler = SIG_IGN;
  sigaction(SIGPIPE, &action, &old_pipe_);
  if (outer_ != nullptr) {
    raise_to(control.stop_requests, outer_->control_.stop_requests.load());
  }
}

StopOnSignal::~StopOnSignal() {
  sigaction(SIGINT, &old_int_, nullptr);
  sigaction(SIGTERM, &old_term_, nullptr);
  sigaction(SIGHUP, &old_hup_, nullptr);
  sigaction(SIGPIPE, &old_pipe_, nullptr);
  innermost = outer_;
}

}  // namespace sinerig::cli
