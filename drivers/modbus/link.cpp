#include "drivers/modbus/link.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <stdexcept>
#include <unistd.h>
#include <utility>

#include <sys/eventfd.h>

#include "drivers/monotonic_time.h"

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
constexpr std::int64_t release_answer_ns = 100'000'000;
constexpr int release_tries = 3;

void signal_event(int fd) noexcept {
  const std::uint64_t one = 1;
  const SystemCall never_waits;
  // A full counter means that the thread has been told already.
  [[maybe_unused]] const ssize_t written = write(fd, &one, sizeof one);
}

Fault fault_of(Outcome outcome) noexcept {
  return outcome == Outcome::timeout ? Fault::timeout : Fault::bus;
}

}  // namespace

Link::Link(LinkSettings settings)
    : settings_{std::move(settings)}, transport_{settings_.connection} {
  durations_.reserve(kept_durations);
}

Link::~Link() {
  if (thread_.joinable()) {
    stop_.store(true);
    signal_event(wake_);
    thread_.join();
  }
  if (wake_ >= 0) close(wake_);
}

std::size_t Link::watch(const Place& place, std::string label) {
  places_.push_back(place);
  labels_.push_back(std::move(label));
  return places_.size() - 1;
}

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
  thread_ = std::thread{[this] {
    serve();
  }};
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

void Link::serve() noexcept {
  while (true) {
    std::uint64_t count = 0;
    if (read(wake_, &count, sizeof count) < 0 && errno != EINTR) return;
    if (stop_.load()) return;
    const std::scoped_lock lock{mutex_};
    serve_one();
  }
}

void Link::serve_one() noexcept {
  Order order;
  if (!orders_.take(order)) return;
  Exchange exchange;
  perform(order, settings_.response_timeout_ns, exchange);
  results_.put(exchange);
  if (!transport_.connected()) reconnect_now_and_then();
}

// A connection is looked for between two ticks, and what the loop handed over meanwhile has been
// replaced by newer orders.
void Link::reconnect_now_and_then() noexcept {
  const std::int64_t now_ns = monotonic_now_ns();
  if (now_ns < next_reconnect_ns_) return;
  transport_.try_connect();
  next_reconnect_ns_ = monotonic_now_ns() + reconnect_period_ns;
}

void Link::reconnect() {
  const std::scoped_lock lock{mutex_};
  if (transport_.connected() || transport_.try_connect()) return;
  throw std::runtime_error(settings_.connection.address() +
                           ": no connection; is the device powered and on the network?");
}

void Link::perform(const Order& order, std::int64_t patience_ns, Exchange& exchange) noexcept {
  exchange.number = order.number;
  exchange.handed_over_ns = order.handed_over_ns;
  exchange.begun_ns = monotonic_now_ns();
  exchange.fate = order.commands ? CommandFate::not_sent : CommandFate::none;
  for (Sample& field : exchange.fields) field.fault = Fault::bus;
  // A set-point that has waited for longer than a tick is an old one: the next is here already.
  const bool too_old = exchange.begun_ns - order.handed_over_ns > settings_.period_ns;
  const ExchangePlan& plan = order.commands ? commanding_plan_ : reading_plan_;
  const std::int64_t deadline_ns = exchange.begun_ns + patience_ns;
  bool failed = false;
  ++asked_;
  for (std::size_t n = 0; n < plan.questions.size() && !(too_old && order.commands); ++n) {
    Request question = plan.questions[n];
    if (question.spare > 0)
      question.read_count =
          static_cast<std::uint16_t>(question.read_count + asked_ % (question.spare + 1U));
    if (question.writes())
      exchange.command = encode(question.words, command_->format, order.command);
    const Answer answer = transport_.ask(question, deadline_ns, registers_);
    if (question.writes()) {
      exchange.command_ns = answer.time_ns;
      const bool taken = answer.outcome == Outcome::ok;
      exchange.fate = taken                                     ? CommandFate::confirmed
                      : answer.outcome == Outcome::exception    ? CommandFate::refused
                      : answer.outcome == Outcome::disconnected ? CommandFate::not_sent
                                                                : CommandFate::unconfirmed;
    }
    if (answer.outcome != Outcome::ok) {
      failed = true;
      // Why the connection went is worth more than that it is still gone.
      if (answer.error != ENOTCONN) failure_ = answer;
      has_failed_ = true;
    }
    for (std::size_t i = 0; i < plan.fields.size(); ++i) {
      const Field& field = plan.fields[i];
      if (field.question != n) continue;
      Sample& sample = exchange.fields[i];
      sample.time_ns = answer.time_ns;
      sample.fault = fault_of(answer.outcome);
      if (answer.outcome != Outcome::ok) continue;
      sample.fault = answer.write_only ? Fault::stale : Fault::none;
      if (answer.write_only) continue;
      sample.value = decode(std::span{registers_}.subspan(field.offset), field.format);
    }
    if (!transport_.connected()) break;
  }
  exchange.ended_ns = monotonic_now_ns();
  if (plan.questions.empty() || transport_.connected()) note_duration(exchange, failed);
}

void Link::note_duration(const Exchange& exchange, bool failed) noexcept {
  if (failed) ++failed_;
  const std::int64_t duration_ns = exchange.ended_ns - exchange.begun_ns;
  if (durations_.size() < kept_durations)
    durations_.push_back(duration_ns);
  else
    durations_[next_duration_ % kept_durations] = duration_ns;
  ++next_duration_;
}

void Link::tick(std::optional<double> command) noexcept {
  fresh_ = results_.take(newest_);
  tick_ns_ = monotonic_now_ns();
  overrun_ = orders_.put({.number = ++number_,
                          .handed_over_ns = tick_ns_,
                          .commands = command.has_value(),
                          .command = command.value_or(0.0)});
  signal_event(wake_);
}

Pace Link::try_out(std::optional<double> command, std::size_t exchanges) {
  const std::scoped_lock lock{mutex_};
  std::vector<std::int64_t> durations;
  std::size_t failed = 0;
  for (std::size_t n = 0; n < exchanges && failed < most_failures && transport_.connected(); ++n) {
    Exchange exchange;
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
      durations.clear();
      failed = 0;
      continue;
    }
    const auto faulty = [](const Sample& field) {
      return field.fault != Fault::none;
    };
    const auto wanted = std::span{exchange.fields}.first(places_.size());
    const bool whole = std::ranges::none_of(wanted, faulty) &&
                       (!command || exchange.fate == CommandFate::confirmed);
    if (whole)
      durations.push_back(exchange.ended_ns - exchange.begun_ns);
    else
      ++failed;
  }
  durations_.clear();
  next_duration_ = 0;
  failed_ = 0;
  return summary(std::move(durations), failed);
}

Pace Link::summary(std::vector<std::int64_t> durations, std::size_t failed) const {
  if (durations.empty()) return {.exchanges = failed, .failed = failed};
  std::ranges::sort(durations);
  const std::size_t last = durations.size() - 1;
  return {.exchanges = durations.size() + failed,
          .failed = failed,
          .median_ns = durations[last / 2],
          .slow_ns = durations[last * 95 / 100],
          .worst_ns = durations[last]};
}

Pace Link::pace() const {
  const std::scoped_lock lock{mutex_};
  Pace pace = summary(durations_, failed_);
  pace.exchanges = next_duration_;
  return pace;
}

TransportCounters Link::counters() const {
  const std::scoped_lock lock{mutex_};
  return transport_.counters();
}

std::string Link::last_failure() const {
  const std::scoped_lock lock{mutex_};
  return has_failed_ ? transport_.describe(failure_) : "";
}

bool Link::release(double neutral, const Sequence& disarm) noexcept {
  const std::scoped_lock lock{mutex_};
  Order ignored;
  orders_.take(ignored);
  commanded_ = false;
  if (!command_) return true;
  bool neutral_is_out = false;
  for (int n = 0; n < release_tries && !neutral_is_out; ++n) {
    if (!transport_.connected() && !transport_.try_connect()) continue;
    const Answer answer = write_number(transport_, *command_, neutral, settings_.writing,
                                       monotonic_now_ns() + release_answer_ns);
    neutral_is_out = answer.outcome == Outcome::ok;
  }
  if (transport_.connected()) run_all(transport_, disarm);
  return neutral_is_out;
}

}  // namespace sinerig::modbus
