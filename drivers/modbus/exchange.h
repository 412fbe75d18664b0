// What is asked of the devices of one connection at every tick, and what came of it.
//
// One command at most is written; every wanted number is read. Numbers that lie side by side are
// read by one question.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "drivers/driver.h"
#include "drivers/modbus/registers.h"
#include "drivers/modbus/request.h"

namespace sinerig::modbus {

// A number in the registers of a device.
struct Place {
  std::uint8_t unit = 1;
  Table table = Table::holding;
  std::uint16_t address = 0;
  Format format;

  std::size_t words() const noexcept { return words_of(format.type); }
};

// How the command is written.
enum class Writing : std::uint8_t {
  automatic,       // function 23, or 16 where the device has no 23
  write_and_read,  // function 23
  multiple,        // function 16, then 3
  single,          // function 6, then 3: numbers of one register
};

// The question for one number.
Request reading(const Place& place);

inline constexpr std::size_t max_fields = 32;

struct Field {
  std::size_t question = 0;  // which question brings it
  std::size_t offset = 0;    // its first register in the answer
  Format format;
};

struct ExchangePlan {
  std::vector<Request> questions;  // with a command to write, the first writes it
  std::vector<Field> fields;       // in the order of the places asked for

  // Registers from one wanted number to the next that are read along when they are no more than
  // `read_through`. Throws std::invalid_argument for more than max_fields places.
  static ExchangePlan make(const std::vector<Place>& places, const Place* command, Writing writing,
                           std::size_t read_through);

  // Bytes on the wire of all questions and answers.
  std::size_t wire_bytes() const noexcept;
};

enum class CommandFate : std::uint8_t {
  none,         // nothing was to be written
  confirmed,    // the device took it
  unconfirmed,  // it may have: no answer, or none that can be believed
  refused,      // exception reply
  not_sent,     // no connection, or too old
};

// The newest exchange as the loop sees it.
struct Exchange {
  std::uint64_t number = 0;
  std::int64_t handed_over_ns = 0;  // by the loop
  std::int64_t begun_ns = 0;
  std::int64_t ended_ns = 0;
  CommandFate fate = CommandFate::none;
  double command = 0.0;  // what the registers mean, engineering unit
  std::int64_t command_ns = 0;
  std::uint8_t exception = 0;
  bool withheld = false;  // something was not read: a late answer could be taken for it
  std::array<Sample, max_fields> fields{};
};

}  // namespace sinerig::modbus
