#include "drivers/modbus/sequence.h"

#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "drivers/monotonic_time.h"

namespace sinerig::modbus {
namespace {

constexpr std::int64_t answer_ns = 500'000'000;
constexpr std::chrono::milliseconds between_readings{5};
constexpr std::chrono::milliseconds before_retry{20};

struct Reading {
  Answer answer;
  double value = 0.0;
};

Reading read_number(Transport& transport, const Place& place, std::int64_t deadline_ns) noexcept {
  std::array<std::uint16_t, max_words> registers{};
  Reading found;
  found.answer = transport.ask(reading(place), deadline_ns, registers);
  if (found.answer.outcome == Outcome::ok) found.value = decode(registers, place.format);
  return found;
}

bool done(const Answer& answer) noexcept {
  return answer.outcome == Outcome::ok || answer.outcome == Outcome::exception;
}

Answer write_step(Transport& transport, const Step& step) noexcept {
  return write_surely(transport, step.place, *step.write, step.writing);
}

// Empty when the step was done, else what went wrong.
std::string perform(Transport& transport, const Step& step, const Waiting& waiting) {
  waiting.go_on();
  if (step.write) {
    const Answer answer = write_step(transport, step);
    if (answer.outcome != Outcome::ok) return transport.describe(answer);
  }
  if (step.expect) {
    const std::int64_t until_ns = monotonic_now_ns() + step.timeout_ns;
    for (;;) {
      const Reading reading = read_number(transport, step.place, monotonic_now_ns() + answer_ns);
      const bool believed = reading.answer.outcome == Outcome::ok;
      if (believed && step.expect->holds(reading.value, step.place.format)) break;
      const bool hopeless = reading.answer.outcome == Outcome::exception || !transport.connected();
      if (hopeless || monotonic_now_ns() >= until_ns) {
        if (!believed) return transport.describe(reading.answer);
        std::ostringstream text;
        text << "register " << step.place.address << " is " << reading.value << ", must be "
             << step.expect->text() << " within " << static_cast<double>(step.timeout_ns) * 1e-9
             << " s";
        return text.str();
      }
      waiting.go_on();
      std::this_thread::sleep_for(between_readings);
    }
  }
  if (!waiting.pause_for(step.delay_ns)) throw StopRequested{};
  return "";
}

}  // namespace

bool Comparison::holds(double measured, const Format& format) const noexcept {
  if (std::isnan(measured)) return false;
  // What the rig file says in decimals is not to the last bit what scale and offset make of a code.
  const double rounding = 4.0 * std::numeric_limits<double>::epsilon() *
                          (std::abs(value) + std::abs(format.offset) + std::abs(format.scale));
  const bool is_float =
      format.type == RegisterType::float32 || format.type == RegisterType::float64;
  std::array<std::uint16_t, max_words> registers{};
  const double as_float = is_float ? std::abs(encode(registers, format, value) - value) : 0.0;
  const double slack = rounding + as_float;
  const double same = is_float ? slack : 0.5 * std::abs(format.scale);
  switch (sign) {
    case Operator::equal: return std::abs(measured - value) <= same;
    case Operator::not_equal: return !(std::abs(measured - value) <= same);
    case Operator::at_most: return measured <= value + slack;
    case Operator::at_least: return measured >= value - slack;
  }
  return false;
}

std::string Comparison::text() const {
  static constexpr const char* signs[] = {"= ", "not ", "<= ", ">= "};
  std::ostringstream text;
  text << signs[static_cast<int>(sign)] << value;
  return text.str();
}

Answer write_number(Transport& transport, const Place& place, double value, Writing writing,
                    std::int64_t deadline_ns) noexcept {
  Request request;
  request.unit = place.unit;
  request.function = writing == Writing::single ? Function::write_single : Function::write_multiple;
  request.write_address = place.address;
  request.write_count = static_cast<std::uint16_t>(place.words());
  encode(request.words, place.format, value);
  const Answer answer = transport.ask(request, deadline_ns, {});
  constexpr std::uint8_t illegal_function = 1;
  const bool unknown = answer.outcome == Outcome::exception && answer.exception == illegal_function;
  const bool has_another = writing == Writing::automatic || writing == Writing::write_and_read;
  if (!unknown || !has_another) return answer;
  // What the loop's commands are written by: a drive may have nothing else.
  request.function = Function::write_and_read;
  request.read_address = request.write_address;
  request.read_count = request.write_count;
  std::array<std::uint16_t, max_words> registers{};
  return transport.ask(request, deadline_ns, registers);
}

Answer write_surely(Transport& transport, const Place& place, double value,
                    Writing writing) noexcept {
  Answer answer;
  for (int n = 0; n < 3; ++n) {
    if (n > 0) std::this_thread::sleep_for(before_retry);
    answer = write_number(transport, place, value, writing, monotonic_now_ns() + answer_ns);
    if (done(answer) || !transport.connected()) break;
  }
  return answer;
}

void run(Transport& transport, const Sequence& sequence, const std::string& list,
         const Waiting& waiting) {
  for (const Step& step : sequence) {
    const std::string wrong = perform(transport, step, waiting);
    if (!wrong.empty()) throw std::runtime_error(list + ", " + step.name + ": " + wrong);
  }
}

bool run_all(Transport& transport, const Sequence& sequence, const Waiting& waiting) noexcept {
  bool all = true;
  for (const Step& step : sequence) {
    if (!transport.connected() && !transport.try_connect()) return false;
    if (step.write) all = write_step(transport, step).outcome == Outcome::ok && all;
    waiting.to_the_end().pause_for(step.delay_ns);
  }
  return all;
}

}  // namespace sinerig::modbus
