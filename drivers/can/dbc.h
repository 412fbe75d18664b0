// Reads the part of a DBC file that says where signals are: BO_, SG_ (multiplexed ones too),
// SIG_VALTYPE_ and SG_MUL_VAL_. Everything else that a DBC file can hold is skipped.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/can/signal.h"

namespace sinerig::can {

struct DbcSignal {
  std::string name;
  Signal signal;
  std::string unit;
  bool is_multiplexor = false;
  std::optional<std::uint64_t> multiplexed_by;  // raw value the multiplexor must have
  std::string multiplexor;                      // its name, where the message has more than one
  bool has_multiplex_ranges = false;            // valid for several values: cannot be bound by name
  int line = 0;
};

struct DbcMessage {
  std::string name;
  std::uint32_t id = 0;
  bool extended = false;
  std::uint8_t length = 0;
  std::vector<DbcSignal> signals;
  int line = 0;

  const DbcSignal* find(std::string_view signal_name) const noexcept;
};

// One signal with everything needed to put it on a bus or find it there.
struct DbcBinding {
  const DbcMessage* message = nullptr;
  const DbcSignal* signal = nullptr;
  std::vector<std::pair<const DbcSignal*, std::uint64_t>> multiplexors;  // and what each must be
};

// Which one a channel is bound to, for people.
struct DbcOrigin {
  std::string name;            // Message.Signal, the message's whole name
  bool perhaps_float = false;  // 32 bits of an integer, not scaled: DBC files often leave out the
                               // SIG_VALTYPE_ that makes them a float
};

DbcOrigin origin_of(const DbcBinding& binding);

class Dbc {
 public:
  // Both throw std::runtime_error "FILE:LINE: what, value, rule".
  static Dbc read_file(const std::string& path);
  static Dbc read_text(std::string_view text, const std::string& file_name);

  // "Message.Signal". A prefix of the message name up to an underscore may be left out
  // ("Get_Iq.Iq_Measured" finds Axis0_Get_Iq); where several messages then fit, they must be alike
  // in everything but their identifier and the one with the lowest is meant.
  DbcBinding find(std::string_view name) const;
  const DbcMessage& find_message(std::string_view name) const;

  const std::vector<DbcMessage>& messages() const noexcept { return messages_; }

 private:
  std::string file_name_;
  std::vector<DbcMessage> messages_;
};

}  // namespace sinerig::can
