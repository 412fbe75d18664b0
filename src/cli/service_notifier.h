// Tells a service manager how a run goes, by the protocol of sd_notify(3): one datagram a message.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "report/remaining_time.h"
#include "sweep/plan.h"

namespace sinerig::cli {

class ServiceNotifier {
 public:
  using Time = std::chrono::steady_clock::time_point;

  // Where $NOTIFY_SOCKET leads, fed as often as $WATCHDOG_USEC asks; nothing at all without them.
  ServiceNotifier();
  // An empty `socket`: nobody is told. `watchdog` 0: it is not fed.
  ServiceNotifier(std::string socket, std::chrono::microseconds watchdog);
  ~ServiceNotifier();
  ServiceNotifier(const ServiceNotifier&) = delete;
  ServiceNotifier& operator=(const ServiceNotifier&) = delete;

  // Told once.
  void ready();
  void status(const std::string& text);

  // The loop is at `tick`. The watchdog is fed where that has moved on since it was fed last, four
  // times in its period at most: a loop that stands still starves it, whoever else is alive.
  void progress(std::uint64_t tick, Time now);

  // No loop is to run now, between the sweeps of a night: the watchdog is fed by time.
  void idle(Time now);

  // The last loop has ended, what is left is writing files.
  void stopping();

 private:
  void send(const std::string& message);

  std::string socket_;
  std::chrono::microseconds watchdog_;
  int descriptor_ = -1;
  bool ready_ = false;
  std::string status_;
  std::uint64_t fed_at_ = UINT64_MAX;
  Time next_{};
};

// "point 3 of 60, 0.61 Hz, 12:40 left"
std::string status_text(const SweepPlan& plan, std::uint32_t dwell,
                        const report::RemainingTime& time);

}  // namespace sinerig::cli
