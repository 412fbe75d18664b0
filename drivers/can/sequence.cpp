#include "drivers/can/sequence.h"

#include <algorithm>
#include <ctime>
#include <sstream>
#include <stdexcept>

namespace sinerig::can {
namespace {

constexpr std::int64_t retry_for_ns = 20'000'000;
constexpr std::int64_t retry_pause_ns = 500'000;

enum class Outcome : std::uint8_t { done, not_sent, no_answer, refused, called_off };

void pause_for(std::int64_t time_ns) noexcept {
  timespec left{time_ns / 1'000'000'000, time_ns % 1'000'000'000};
  while (nanosleep(&left, &left) != 0) {
  }
}

// The answer counts only if it comes after the frame: what lay in the socket before is taken in
// first.
Outcome run_once(Bus& bus, const Step& step, const Waiting& waiting, Patience& patience) noexcept {
  if (!waiting.may_go_on()) return Outcome::called_off;
  bus.drain();
  const bool expects = step.expect.has_value();
  const std::uint64_t answers = expects ? bus.slot(step.expect->slot).count : 0;
  const bool refusable = expects && step.expect->refusal.has_value();
  const std::uint64_t refusals = refusable ? bus.slot(step.expect->refusal_slot).count : 0;

  if (step.frame && send_surely(bus, *step.frame, patience) != SendResult::sent)
    return Outcome::not_sent;
  for (const Frame& frame : step.company)
    if (send_surely(bus, frame, patience) != SendResult::sent) return Outcome::not_sent;
  if (!expects) return Outcome::done;

  const std::int64_t deadline_ns = monotonic_ns() + step.expect->timeout_ns;
  while (true) {
    if (refusable && bus.slot(step.expect->refusal_slot).count != refusals) return Outcome::refused;
    if (bus.slot(step.expect->slot).count != answers) return Outcome::done;
    const std::int64_t left_ns = deadline_ns - monotonic_ns();
    if (left_ns <= 0) return Outcome::no_answer;
    if (!waiting.may_go_on()) return Outcome::called_off;
    bus.wait_and_poll(std::min(left_ns, Waiting::turn_ns));
  }
}

Outcome run_step(Bus& bus, const Step& step, const Waiting& waiting, Patience& patience) noexcept {
  Outcome outcome = Outcome::no_answer;
  for (std::uint32_t n = 0; n < step.repeats && outcome == Outcome::no_answer; ++n)
    outcome = run_once(bus, step, waiting, patience);
  if (outcome != Outcome::called_off && !waiting.pause_for(step.delay_ns))
    return Outcome::called_off;
  return outcome;
}

std::string bytes_text(const Frame& frame) {
  static constexpr char digits[] = "0123456789ABCDEF";
  std::string text;
  for (const std::uint8_t byte : frame.payload()) {
    text += text.empty() ? "" : " ";
    text += digits[byte >> 4U];
    text += digits[byte & 0xFU];
  }
  return text;
}

}  // namespace

void listen_for(Bus& bus, Sequence& sequence) {
  for (Step& step : sequence) {
    if (!step.expect) continue;
    step.expect->slot = bus.listen(step.expect->pattern);
    if (step.expect->refusal) step.expect->refusal_slot = bus.listen(*step.expect->refusal);
  }
}

void run(Bus& bus, const Sequence& sequence, const std::string& list_name) {
  Patience patience;
  for (const Step& step : sequence) {
    const Outcome outcome = run_step(bus, step, bus.waiting(), patience);
    if (outcome == Outcome::done) continue;
    if (outcome == Outcome::called_off) throw StopRequested{};
    std::ostringstream message;
    message << bus.interface() << ": " << list_name << " step '" << step.name << "' ";
    switch (outcome) {
      case Outcome::not_sent:
        message
            << "could not be sent: the bus is " << to_string(bus.state())
            << (bus.state() == BusState::up
                    ? " but its transmit queue is full, as it is when nobody acknowledges; check "
                      "wiring, bit rate and termination"
                    : "; `ip -details link show " + bus.interface() + "` tells more");
        break;
      case Outcome::refused:
        message << "was refused by the device: "
                << bytes_text(bus.slot(step.expect->refusal_slot).frame);
        break;
      case Outcome::no_answer:
        message << "was not answered with "
                << id_text(step.expect->pattern.id, step.expect->pattern.extended) << " within "
                << static_cast<double>(step.expect->timeout_ns) * 1e-6
                << " ms; is the device powered, and its node id and bit rate right?";
        break;
      case Outcome::done:
      case Outcome::called_off: break;
    }
    throw std::runtime_error(message.str());
  }
}

int run_all(Bus& bus, const Sequence& sequence, Patience& patience) noexcept {
  int failed = 0;
  for (const Step& step : sequence)
    if (run_step(bus, step, bus.waiting().to_the_end(), patience) != Outcome::done) ++failed;
  return failed;
}

// Time is counted, not read: every turn sleeps, whatever poll() finds.
SendResult send_surely(Bus& bus, const Frame& frame, Patience& patience) noexcept {
  Patience for_room{.left_ns = retry_for_ns};
  SendResult result = bus.send(frame);
  while (result != SendResult::sent) {
    const bool full = result == SendResult::queue_full;
    if (!full && bus.state() == BusState::up) break;  // such a frame never goes
    Patience& limit = full ? for_room : patience;
    if (limit.left_ns <= 0) break;
    limit.left_ns -= retry_pause_ns;
    pause_for(retry_pause_ns);
    bus.poll();  // tells when a dead bus is back
    result = bus.send(frame);
  }
  return result;
}

}  // namespace sinerig::can
