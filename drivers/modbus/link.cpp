#include "drivers/modbus/link.h"

#include <algorithm>
#include <cerrno>
#include <unistd.h>
#include <utility>

#include "drivers/monotonic_time.h"

namespace sinerig::modbus {
namespace {

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

Link::Link(LinkSettings settings, const Waiting& waiting)
    : settings_{std::move(settings)}, waiting_{waiting}, transport_{settings_.connection} {}

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
  if (connect_and_hear()) {
    pause_ns_ = first_pause_ns;
    silent_.store(false, std::memory_order_relaxed);
  }
  next_reconnect_ns_ = monotonic_now_ns() + pause_ns_;
  if (!transport_.connected()) pause_ns_ = std::min(2 * pause_ns_, longest_pause_ns);
}

// Many a device that has stopped reading is still connected to by its system, and would carry out,
// later, what it was sent. It gets set-points again when it has answered a question, be it with an
// exception: of what is read anyway, or of where its command is.
bool Link::connect_and_hear() noexcept {
  if (!transport_.try_connect()) return false;
  if (settings_.connection.serial) return true;
  const Request question =
      reading_plan_.questions.empty() ? reading(*command_) : reading_plan_.questions.front();
  const std::int64_t deadline_ns =
      monotonic_now_ns() + std::max(settings_.response_timeout_ns, hearing_ns);
  const Answer answer = transport_.ask(question, deadline_ns, registers_);
  if (answer.outcome != Outcome::timeout) return transport_.connected();
  note_failure(answer);
  transport_.give_up();
  return false;
}

// Why the connection went is worth more than that it is still gone.
void Link::note_failure(const Answer& answer) noexcept {
  if (answer.error != ENOTCONN) failure_ = answer;
  has_failed_ = true;
  failure_ns_ = monotonic_now_ns();
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
  bool lost = false;
  exchange.withheld = false;
  ++asked_;
  transport_.set_usual_patience(patience_ns);
  for (std::size_t n = 0; n < plan.questions.size() && !(too_old && order.commands); ++n) {
    // An answer that nobody waits for is a late one from the start.
    if (n > 0 && monotonic_now_ns() >= deadline_ns) {
      for (std::size_t i = 0; i < plan.fields.size(); ++i)
        if (plan.fields[i].question >= n) exchange.fields[i].fault = Fault::timeout;
      if (!failed) note_failure(Answer{.outcome = Outcome::timeout});
      failed = lost = true;
      break;
    }
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
      exchange.fate = taken                                  ? CommandFate::confirmed
                      : answer.outcome == Outcome::exception ? CommandFate::refused
                      : answer.outcome == Outcome::disconnected && !silent()
                          ? CommandFate::not_sent
                          : CommandFate::unconfirmed;
      if (answer.outcome == Outcome::timeout && !transport_.connected())
        silent_.store(true, std::memory_order_relaxed);
    }
    exchange.withheld = exchange.withheld || answer.withheld;
    lost = lost || (answer.outcome != Outcome::ok && !answer.withheld);
    if (answer.outcome != Outcome::ok) {
      failed = true;
      note_failure(answer);
    }
    for (std::size_t i = 0; i < plan.fields.size(); ++i) {
      const Field& field = plan.fields[i];
      if (field.question != n) continue;
      Sample& sample = exchange.fields[i];
      sample.time_ns = answer.time_ns;
      sample.fault = fault_of(answer.outcome);
      if (answer.outcome != Outcome::ok) continue;
      sample.fault = answer.withheld ? Fault::stale : Fault::none;
      if (answer.withheld) continue;
      sample.value = decode(std::span{registers_}.subspan(field.offset), field.format);
    }
    if (!transport_.connected()) break;
  }
  // One that asked for something and got no answer has failed, whatever else it held back.
  exchange.withheld = exchange.withheld && !lost;
  exchange.ended_ns = monotonic_now_ns();
  if (plan.questions.empty() || transport_.connected())
    pace_.add(exchange.ended_ns - exchange.begun_ns, failed);
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

Pace Link::pace() const {
  const std::scoped_lock lock{mutex_};
  return pace_.pace();
}

TransportCounters Link::counters() const {
  const std::scoped_lock lock{mutex_};
  return transport_.counters();
}

std::string Link::recent_failure() const {
  constexpr std::int64_t news_ns = 1'000'000'000;
  const std::scoped_lock lock{mutex_};
  const bool recent = has_failed_ && failure_ns_ > tick_ns_ - news_ns;
  return recent ? transport_.describe(failure_) : "";
}

std::string Link::describe(const Answer& answer) const {
  const std::scoped_lock lock{mutex_};
  return transport_.describe(answer);
}

std::string Link::last_failure() const {
  const std::scoped_lock lock{mutex_};
  return has_failed_ ? transport_.describe(failure_) : "";
}

}  // namespace sinerig::modbus
