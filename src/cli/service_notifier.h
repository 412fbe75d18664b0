// Tells a service manager how a run goes, by the protocol of sd_notify(3): one datagram a message.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

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

  // RunControl::progress(). The watchdog is fed where that has moved on since it was fed last, four
  // times in its period at most: a loop that stands still starves it, whoever else is alive. Before
  // ready() and after stopping() the manager is asked for more time, too: it counts that itself.
  void progress(std::uint64_t progress, Time now);

  // No loop is to run now, between the sweeps of a night: fed by time.
  void idle(Time now);

  // The last loop has ended, what is left is writing files.
  void stopping();

  // Whether anybody is told.
  bool heard() const noexcept { return descriptor_ >= 0; }

 private:
  void send(const std::string& message);
  void feed(Time now);

  std::string socket_;
  std::chrono::microseconds watchdog_;
  int descriptor_ = -1;
  bool ready_ = false;
  bool stopping_ = false;
  std::string status_;
  std::uint64_t fed_at_ = UINT64_MAX;
  Time next_{};
};

// Moves on for as long as all is well.
using SignOfLife = std::function<std::uint64_t()>;

// For work that knows no turns, on files say: the time, until it has taken suspiciously long.
SignOfLife for_at_most(std::chrono::nanoseconds limit);

// Feeds the watchdog from a thread of its own for as long as this lives: the one that tells of the
// run is busy, and leaves `service` alone.
class Attendant {
 public:
  Attendant(ServiceNotifier& service, SignOfLife life);
  ~Attendant();
  Attendant(const Attendant&) = delete;
  Attendant& operator=(const Attendant&) = delete;

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool done_ = false;
  std::thread thread_;
};

template <class Work>
auto attended(ServiceNotifier& service, SignOfLife life, Work work) {
  const Attendant attendant{service, std::move(life)};
  return work();
}

// "point 3 of 60, 0.61 Hz, 12:40 left"
std::string status_text(const SweepPlan& plan, std::uint32_t dwell,
                        const report::RemainingTime& time);

}  // namespace sinerig::cli
