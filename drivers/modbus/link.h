// One connection in the loop: its own thread asks and waits, paced by the loop's ticks; the loop
// hands a command over and takes the newest exchange, and never waits.
//
// tick() takes the exchange that has ended before it hands the next one over: what a tick sees does
// not depend on how fast the thread is. Outside the loop the connection is used under idle().
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "drivers/mailbox.h"
#include "drivers/modbus/exchange.h"
#include "drivers/modbus/pace.h"
#include "drivers/modbus/sequence.h"
#include "drivers/modbus/transport.h"
#include "realtime/rights.h"
#include "sweep/nonblocking.h"

namespace sinerig::modbus {

// Part of a period that an exchange may wait for its answers.
inline constexpr double usual_timeout = 0.75;
inline constexpr double longest_timeout = 0.9;

struct LinkSettings {
  ConnectionSettings connection;
  Writing writing = Writing::automatic;
  std::int64_t period_ns = 0;            // of the loop
  std::int64_t response_timeout_ns = 0;  // of a whole exchange
  std::size_t read_through = 0;
  // Of the loop in real time: the thread runs one priority below it. Nothing: an ordinary thread.
  std::optional<realtime::Settings> loop;
};

class Link {
 public:
  // `waiting`: for what is done outside of the loop.
  explicit Link(LinkSettings settings, const Waiting& waiting = {});
  ~Link();
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  // Before open(): a number to be read at every tick; its index among the fields of an exchange.
  std::size_t watch(const Place& place, std::string label);
  void command(const Place& place) { command_ = place; }

  // Connects, reads everything once, starts the thread. Throws std::runtime_error; StopRequested,
  // as try_out(), where a stop is.
  void open();

  // Outside the loop, with the thread at rest.
  template <class Use>
  auto idle(Use use) {
    const std::scoped_lock lock{mutex_};
    return use(transport_);
  }

  // Outside the loop: a new connection in any case over TCP, where one can be gone and look whole;
  // on a serial line where it is gone. Throws std::runtime_error.
  void reconnect();

  // Exchanges as in the loop, outside of it; with a command where one is given. Those that ask for
  // nothing, because a late answer may still come, don't count. Falls back from function 23 to 16
  // where the device does not know it and the rig file leaves the choice.
  Pace try_out(std::optional<double> command, std::size_t exchanges);
  std::string last_failure() const;
  // The same where it is of the last second before the newest tick; empty: what has happened since
  // has another cause. Not while the loop runs.
  std::string recent_failure() const;
  std::string describe(const Answer& answer) const;
  Pace pace() const;  // of the loop so far
  TransportCounters counters() const;

  // After open(): how the thread runs.
  const std::optional<realtime::Grant>& scheduling() const noexcept { return scheduling_; }

  // From now on ticks carry a command, and only they pace the exchanges.
  void set_commanded(bool commanded) noexcept { commanded_ = commanded; }
  bool commanded() const noexcept { return commanded_; }

  // The loop's.
  void tick(std::optional<double> command) noexcept SINERIG_NONBLOCKING;
  bool fresh() const noexcept { return fresh_; }      // an exchange has ended since the last tick
  bool overrun() const noexcept { return overrun_; }  // the last order was never taken up
  // The device has not answered, and is given set-points again when it has: nothing of them is
  // known, which is no failure until it has lasted for too long.
  bool silent() const noexcept { return silent_.load(std::memory_order_relaxed); }
  std::int64_t tick_ns() const noexcept { return tick_ns_; }
  const Exchange& newest() const noexcept { return newest_; }

  struct Released {
    bool neutral = false;   // taken by the device
    bool disarmed = false;  // every step was
    Answer answer{};        // to neutral
  };

  // Neutral at once, whatever the loop has handed over, then `disarm`. Bounded in time. A
  // connection that takes neutral no more than the set-points before it is given up with all that
  // it holds.
  Released release(double neutral, const Sequence& disarm) noexcept;

  // Between two runs of the loop: an exchange that ended before is none of the next one's.
  void forget() noexcept;

  const LinkSettings& settings() const noexcept { return settings_; }
  const Waiting& waiting() const noexcept { return waiting_; }

 private:
  struct Order {
    std::uint64_t number = 0;
    std::int64_t handed_over_ns = 0;
    bool commands = false;
    double command = 0.0;
  };

  void serve() noexcept;
  void serve_one() noexcept;
  void perform(const Order& order, std::int64_t patience_ns, Exchange& exchange) noexcept;
  void drop_exchanges() noexcept;  // with the mutex held
  void make_plans();
  void find_spare_registers();
  void reconnect_now_and_then() noexcept;
  bool connect_and_hear() noexcept;
  void note_failure(const Answer& answer) noexcept;

  // Between two attempts: a device that restarts is often back after a few ticks.
  static constexpr std::int64_t first_pause_ns = 10'000'000;
  static constexpr std::int64_t longest_pause_ns = 100'000'000;
  // For the first answer on a new connection, which a gateway may be slow to give.
  static constexpr std::int64_t hearing_ns = 50'000'000;
  // For a device that takes one connection, and is slow to notice that the last one has ended.
  static constexpr int tries_to_reconnect = 20;

  LinkSettings settings_;
  Waiting waiting_;
  std::vector<Place> places_;
  std::vector<std::string> labels_;
  std::optional<Place> command_;

  // The loop's.
  Mailbox<Order> orders_;      // loop → thread
  Mailbox<Exchange> results_;  // thread → loop
  Exchange newest_;
  std::uint64_t number_ = 0;
  std::int64_t tick_ns_ = 0;
  bool fresh_ = false;
  bool overrun_ = false;
  bool commanded_ = false;

  // Whoever holds the mutex: the thread for an exchange, others between them.
  mutable std::mutex mutex_;
  Transport transport_;
  std::vector<Request> spares_;  // what was found out about what can be read beyond what is wanted
  std::uint64_t asked_ = 0;
  ExchangePlan reading_plan_;
  ExchangePlan commanding_plan_;
  std::array<std::uint16_t, max_read_registers> registers_{};
  PaceRecord pace_;
  Answer failure_;
  bool has_failed_ = false;
  std::int64_t failure_ns_ = 0;
  std::int64_t next_reconnect_ns_ = 0;
  std::int64_t pause_ns_ = first_pause_ns;

  int wake_ = -1;
  std::optional<realtime::Grant> scheduling_;
  std::atomic<bool> stop_{false};
  std::atomic<bool> silent_{false};
  std::thread thread_;
};

}  // namespace sinerig::modbus
