// What a connection does outside the loop: it is opened, tried out, opened again, released.
#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <future>
#include <pthread.h>
#include <stdexcept>
#include <utility>

#include <sys/eventfd.h>

#include "drivers/modbus/link.h"
#include "drivers/monotonic_time.h"
#include "realtime/thread_rights.h"

namespace sinerig::modbus {
namespace {

constexpr std::int64_t opening_ns = 500'000'000;

// On a serial line five tries are spent on waiting for an answer that may come late.
constexpr int opening_tries = 8;
constexpr std::uint16_t most_spare = 3;

// A trial waits for slow answers, to tell how slow they are, but not for a device that says
// nothing.
constexpr std::int64_t trial_ns = 200'000'000;
constexpr std::size_t most_failures = 12;
constexpr std::chrono::milliseconds between_withheld{1};
constexpr std::int64_t release_answer_ns = 100'000'000;
constexpr int release_tries = 3;

}  // namespace

void Link::make_plans() {
  reading_plan_ = ExchangePlan::make(places_, nullptr, settings_.writing, settings_.read_through);
  commanding_plan_ = ExchangePlan::make(places_, command_ ? &*command_ : nullptr, settings_.writing,
                                        settings_.read_through);
  for (ExchangePlan* plan : {&reading_plan_, &commanding_plan_}) {
    for (Request& question : plan->questions) {
      const auto found = std::ranges::find_if(spares_, [&](const Request& known) {
        const bool same_table =
            (known.function == Function::read_input) == (question.function == Function::read_input);
        return known.unit == question.unit && same_table &&
               known.read_address == question.read_address &&
               known.read_count == question.read_count;
      });
      if (found != spares_.end()) question.spare = found->spare;
    }
  }
}

// Serial lines: how many registers more than wanted each question may ask for.
void Link::find_spare_registers() {
  if (!settings_.connection.serial) return;
  spares_ = reading_plan_.questions;
  for (Request& question : spares_) {
    while (question.spare < most_spare) {
      waiting_.go_on();
      Request longer = question;
      longer.spare = 0;
      longer.read_count = static_cast<std::uint16_t>(question.read_count + question.spare + 1);
      if (longer.read_count > max_read_registers) break;
      const Answer answer = transport_.ask(longer, monotonic_now_ns() + opening_ns, registers_);
      if (answer.outcome != Outcome::ok) break;
      ++question.spare;
    }
  }
  make_plans();
}

void Link::open() {
  make_plans();
  transport_.connect();
  if (!reading_plan_.questions.empty()) transport_.look_for_echo(reading_plan_.questions.front());
  // Each number by itself, so that a wrong address is said of the channel that has it.
  for (std::size_t n = 0; n < places_.size(); ++n) {
    const ExchangePlan alone = ExchangePlan::make({places_[n]}, nullptr, settings_.writing, 0);
    Answer answer;
    for (int tries = 0; tries < opening_tries && transport_.connected(); ++tries) {
      waiting_.go_on();
      const std::int64_t deadline_ns = monotonic_now_ns() + opening_ns;
      answer = transport_.ask(alone.questions.front(), deadline_ns, registers_);
      if (answer.outcome == Outcome::ok || answer.outcome == Outcome::exception) break;
      // Refused at once while the answer to the last try may still come.
      const std::int64_t left_ns = deadline_ns - monotonic_now_ns();
      if (settings_.connection.serial && left_ns > 0)
        std::this_thread::sleep_for(std::chrono::nanoseconds{left_ns});
    }
    if (answer.outcome != Outcome::ok)
      throw std::runtime_error(labels_[n] + ", register " + std::to_string(places_[n].address) +
                               " of unit " + std::to_string(places_[n].unit) + " at " +
                               transport_.describe(answer));
  }
  find_spare_registers();
  wake_ = eventfd(0, EFD_CLOEXEC);
  if (wake_ < 0)
    throw std::runtime_error(std::string{"no eventfd for the Modbus thread: "} +
                             std::strerror(errno));
  // Signals belong to the threads that expect them.
  sigset_t all;
  sigset_t before;
  sigfillset(&all);
  pthread_sigmask(SIG_BLOCK, &all, &before);
  std::promise<std::optional<realtime::Grant>> entered;
  thread_ = std::thread{[this, &entered] {
    pthread_setname_np(pthread_self(), "sinerig-modbus");
    std::optional<realtime::Grant> scheduling;
    if (settings_.loop) scheduling = realtime::follow(*settings_.loop);
    entered.set_value(std::move(scheduling));
    serve();
  }};
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  scheduling_ = entered.get_future().get();
}

void Link::reconnect() {
  const std::scoped_lock lock{mutex_};
  if (!settings_.connection.serial) transport_.give_up();
  silent_.store(false, std::memory_order_relaxed);
  for (int n = 0; n < tries_to_reconnect; ++n) {
    if (transport_.connected() || transport_.try_connect()) return;
    if (!waiting_.pause_for(Waiting::turn_ns)) throw StopRequested{};
  }
  throw std::runtime_error(settings_.connection.address() +
                           ": no connection; is the device powered and on the network?");
}

Pace Link::try_out(std::optional<double> command, std::size_t exchanges) {
  const std::scoped_lock lock{mutex_};
  PaceRecord tried;
  std::size_t asked = 0;
  std::size_t failed = 0;
  while (asked < exchanges && failed < most_failures && transport_.connected()) {
    waiting_.go_on();
    Exchange exchange;
    // In the loop it has passed by the next tick.
    transport_.keep_silence(monotonic_now_ns() + trial_ns);
    const Order order{.number = 0,
                      .handed_over_ns = monotonic_now_ns(),
                      .commands = command.has_value(),
                      .command = command.value_or(0.0)};
    perform(order, trial_ns, exchange);
    constexpr std::uint8_t illegal_function = 1;
    const bool unknown = exchange.fate == CommandFate::refused &&
                         failure_.exception == illegal_function &&
                         commanding_plan_.questions.front().function == Function::write_and_read;
    if (unknown && settings_.writing == Writing::automatic) {
      settings_.writing = Writing::multiple;
      make_plans();
      continue;
    }
    if (exchange.withheld && (!command || exchange.fate == CommandFate::confirmed)) {
      std::this_thread::sleep_for(between_withheld);
      continue;
    }
    const auto faulty = [](const Sample& field) {
      return field.fault != Fault::none;
    };
    const auto wanted = std::span{exchange.fields}.first(places_.size());
    const bool whole = std::ranges::none_of(wanted, faulty) &&
                       (!command || exchange.fate == CommandFate::confirmed);
    ++asked;
    if (whole)
      tried.add(exchange.ended_ns - exchange.begun_ns, false);
    else
      ++failed;
  }
  pace_.clear();
  Pace pace = tried.pace();
  pace.exchanges = asked;
  pace.failed = failed;
  return pace;
}

void Link::forget() noexcept {
  const std::scoped_lock lock{mutex_};
  drop_exchanges();
}

void Link::drop_exchanges() noexcept {
  Order order;
  orders_.take(order);
  Exchange exchange;
  results_.take(exchange);
  fresh_ = false;
}

Link::Released Link::release(double neutral, const Sequence& disarm) noexcept {
  const std::scoped_lock lock{mutex_};
  drop_exchanges();
  commanded_ = false;
  if (!command_) return {.neutral = true, .disarmed = true, .answer = {}};
  Released released;
  for (int n = 0; n < release_tries && !released.neutral; ++n) {
    if (!transport_.connected() && !transport_.try_connect()) {
      released.answer = Answer{.error = errno};
      continue;
    }
    released.answer = write_number(transport_, *command_, neutral, settings_.writing,
                                   monotonic_now_ns() + release_answer_ns);
    released.neutral = released.answer.outcome == Outcome::ok;
    // From here on nothing but neutral and the list is in the connection.
    const bool silent = released.answer.outcome == Outcome::timeout;
    if (n == 0 && silent && !settings_.connection.serial) transport_.give_up();
  }
  released.disarmed = run_all(transport_, disarm, waiting_);
  return released;
}

}  // namespace sinerig::modbus
