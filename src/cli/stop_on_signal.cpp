#include "cli/stop_on_signal.h"

#include <atomic>

namespace sinerig::cli {

namespace {

// Set by the signal handler's owner, read in the handler.
std::atomic<RunControl*> running{nullptr};

void count_stop_request(int /*signal*/) {
  if (RunControl* control = running.load()) control->stop_requests.fetch_add(1);
}

}  // namespace

StopOnSignal::StopOnSignal(RunControl& control) {
  outer_ = running.exchange(&control);
  struct sigaction action {};
  action.sa_handler = count_stop_request;
  sigaction(SIGINT, &action, &old_int_);
  sigaction(SIGTERM, &action, &old_term_);
  sigaction(SIGHUP, &action, &old_hup_);
  action.sa_handler = SIG_IGN;
  sigaction(SIGPIPE, &action, &old_pipe_);
}

StopOnSignal::~StopOnSignal() {
  sigaction(SIGINT, &old_int_, nullptr);
  sigaction(SIGTERM, &old_term_, nullptr);
  sigaction(SIGHUP, &old_hup_, nullptr);
  sigaction(SIGPIPE, &old_pipe_, nullptr);
  running = outer_;
}

}  // namespace sinerig::cli
