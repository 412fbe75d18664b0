// What is done once, outside the loop: lists of registers to write and of values to wait for.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/modbus/exchange.h"
#include "drivers/modbus/transport.h"
#include "sweep/waiting.h"

namespace sinerig::modbus {

struct Comparison {
  enum class Operator : std::uint8_t { equal, not_equal, at_most, at_least };
  Operator sign = Operator::equal;
  double value = 0.0;

  // Of a number read in this format: equal is what is the same code. NaN holds for nothing.
  bool holds(double measured, const Format& format) const noexcept;
  std::string text() const;  // "= 1"
};

struct Step {
  std::string name;
  Place place;
  Writing writing = Writing::multiple;
  std::optional<double> write;
  std::optional<Comparison> expect;  // read again until it holds
  std::int64_t timeout_ns = 500'000'000;
  std::int64_t delay_ns = 0;  // afterwards
};
using Sequence = std::vector<Step>;

// Throws std::runtime_error naming the list, the step and what the device said; StopRequested where
// a stop is: no further step is begun.
void run(Transport& transport, const Sequence& sequence, const std::string& list,
         const Waiting& waiting = {});

// Every step whatever becomes of the others, for ways out. True when all was done.
bool run_all(Transport& transport, const Sequence& sequence, const Waiting& waiting = {}) noexcept;

// Writes one number: by function 16, or 6 for Writing::single; where the device knows no 16 and the
// loop writes by 23 or may, by 23. `deadline_ns` as Transport::ask.
Answer write_number(Transport& transport, const Place& place, double value, Writing writing,
                    std::int64_t deadline_ns) noexcept;

// The same outside the loop, where a lost answer is worth a second try; a refusal is final.
Answer write_surely(Transport& transport, const Place& place, double value,
                    Writing writing) noexcept;

}  // namespace sinerig::modbus
