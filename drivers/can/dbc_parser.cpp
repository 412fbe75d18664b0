#include "drivers/can/dbc_parser.h"

#include <algorithm>
#include <charconv>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "drivers/can/dbc_scanner.h"
#include "drivers/can/frame_pattern.h"

namespace sinerig::can {
namespace {

constexpr std::uint32_t extended_flag = 0x80000000U;
// Holds the signals that are in no message; its length says nothing about a frame.
constexpr std::string_view orphans_name = "VECTOR__INDEPENDENT_SIG_MSG";

constexpr std::string_view skipped_statements[] = {
    "CM_",        "BA_DEF_", "BA_",         "BA_DEF_DEF_",   "BA_DEF_REL_",
    "BA_REL_",    "VAL_",    "VAL_TABLE_",  "SIG_GROUP_",    "BA_DEF_DEF_REL_",
    "BO_TX_BU_",  "EV_",     "EV_DATA_",    "ENVVAR_DATA_",  "BA_DEF_SGTYPE_",
    "BA_SGTYPE_", "SGTYPE_", "SGTYPE_VAL_", "SIG_TYPE_REF_", "SIGTYPE_VALTYPE_",
    "CAT_DEF_",   "CAT_",    "FILTER",      "BU_SG_REL_",    "BU_EV_REL_",
    "BU_BO_REL_"};

class Parser {
 public:
  Parser(std::string_view text, const std::string& file_name) : scanner_(text, file_name) {}

  std::vector<DbcMessage> parse() {
    while (!scanner_.at_end()) statement();
    return std::move(messages_);
  }

 private:
  void statement() {
    const std::string_view keyword = scanner_.word("a keyword such as BO_");
    if (keyword == "BO_") return message();
    if (keyword == "SG_") return signal();
    if (keyword == "SIG_VALTYPE_") return value_type();
    if (keyword == "SG_MUL_VAL_") return multiplex_values();
    if (keyword == "NS_" || keyword == "BU_") return scanner_.skip_indented_block();
    if (keyword == "VERSION" || keyword == "BS_") return scanner_.skip_line();
    if (std::ranges::find(skipped_statements, keyword) != std::end(skipped_statements))
      return scanner_.skip_statement();
    scanner_.refuse("unknown keyword '" + std::string(keyword) + "'");
  }

  void message() {
    DbcMessage message;
    message.line = scanner_.line();
    const auto raw_id = scanner_.number<std::uint32_t>("a message identifier");
    message.name = scanner_.word("a message name");
    scanner_.expect(':', "after the message name");
    const auto length = scanner_.number<unsigned>("the message's length in bytes");
    scanner_.skip_line();

    in_orphans_ = message.name == orphans_name;
    message.extended = (raw_id & extended_flag) != 0;
    message.id = raw_id & ~extended_flag;
    if (in_orphans_) return;
    const std::uint32_t highest = message.extended ? max_extended_id : max_standard_id;
    if (message.id > highest)
      scanner_.refuse_at(message.line, "BO_ " + message.name + ": identifier " +
                                           std::to_string(raw_id) +
                                           " does not fit into 11 bits; a 29-bit one has 2147483648"
                                           " (bit 31) added");
    if (length > max_fd_bytes)
      scanner_.refuse_at(message.line, "BO_ " + message.name + ": a payload of " +
                                           std::to_string(length) + " bytes; CAN-FD has up to 64");
    for (const DbcMessage& other : messages_)
      if (other.id == message.id && other.extended == message.extended)
        scanner_.refuse_at(message.line, "BO_ " + message.name + ": identifier " +
                                             id_text(message.id, message.extended) +
                                             " was given to " + other.name + " on line " +
                                             std::to_string(other.line));
    message.length = static_cast<std::uint8_t>(length);
    messages_.push_back(std::move(message));
  }

  void signal() {
    DbcSignal parsed;
    parsed.line = scanner_.line();
    parsed.name = scanner_.word("a signal name");
    if (!scanner_.take(':')) {
      multiplex_indicator(parsed);
      scanner_.expect(':', "after the signal name");
    }
    const auto start_bit = scanner_.number<unsigned>("the start bit");
    scanner_.expect('|', "between start bit and length");
    const auto length = scanner_.number<unsigned>("the length in bits");
    scanner_.expect('@', "before the byte order");
    const auto order = scanner_.number<unsigned>("the byte order, 0 or 1");
    const bool is_signed = scanner_.take('-');
    if (!is_signed) scanner_.expect('+', "or '-' after the byte order");
    scanner_.expect('(', "before the scale");
    parsed.signal.scale = scanner_.number<double>("the scale");
    scanner_.expect(',', "between scale and offset");
    parsed.signal.offset = scanner_.number<double>("the offset");
    scanner_.expect(')', "after the offset");
    scanner_.expect('[', "before the minimum");
    const auto minimum = scanner_.number<double>("the minimum");
    scanner_.expect('|', "between minimum and maximum");
    const auto maximum = scanner_.number<double>("the maximum");
    scanner_.expect(']', "after the maximum");
    parsed.unit = scanner_.quoted("the unit");
    scanner_.skip_line();

    if (in_orphans_) return;
    if (messages_.empty())
      scanner_.refuse_at(parsed.line, "SG_ " + parsed.name + " belongs to no BO_");
    if (order > 1)
      scanner_.refuse_at(parsed.line, "SG_ " + parsed.name + ": byte order @" +
                                          std::to_string(order) +
                                          "; it is 0 (Motorola) or 1 (Intel)");
    if (length < 1 || length > 64 || start_bit >= max_fd_bytes * 8)
      scanner_.refuse_at(parsed.line, "SG_ " + parsed.name + ": " + std::to_string(start_bit) +
                                          "|" + std::to_string(length) +
                                          "; a signal has 1 to 64 bits and starts below bit 512");
    parsed.signal.start_bit = static_cast<std::uint16_t>(start_bit);
    parsed.signal.length = static_cast<std::uint8_t>(length);
    parsed.signal.order = order == 1 ? ByteOrder::intel : ByteOrder::motorola;
    parsed.signal.encoding = is_signed ? Encoding::signed_integer : Encoding::unsigned_integer;
    if (minimum < maximum) {
      parsed.signal.minimum = minimum;
      parsed.signal.maximum = maximum;
    }
    add(std::move(parsed));
  }

  void add(DbcSignal parsed) {
    DbcMessage& message = messages_.back();
    if (const DbcSignal* other = message.find(parsed.name))
      scanner_.refuse_at(parsed.line, "SG_ " + parsed.name + " is in " + message.name +
                                          " already, on line " + std::to_string(other->line));
    check_signal(message, parsed, parsed.line);
    message.signals.push_back(std::move(parsed));
  }

  void check_signal(const DbcMessage& message, const DbcSignal& parsed, int line) {
    try {
      check(parsed.signal, message.length);
    } catch (const std::invalid_argument& error) {
      scanner_.refuse_at(line, message.name + "." + parsed.name + ": " + error.what());
    }
  }

  // "M", "m3" or "m3M".
  void multiplex_indicator(DbcSignal& parsed) {
    std::string_view text = scanner_.word("':' or a multiplexing mark");
    const std::string whole(text);
    if (text.size() > 1 && text.front() == 'm') {
      text.remove_prefix(1);
      std::uint64_t value = 0;
      const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
      if (error != std::errc{})
        scanner_.refuse("multiplexing mark '" + whole + "'; it is M, m<number> or m<number>M");
      parsed.multiplexed_by = value;
      text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    }
    if (text == "M")
      parsed.is_multiplexor = true;
    else if (!text.empty())
      scanner_.refuse("multiplexing mark '" + whole + "'; it is M, m<number> or m<number>M");
  }

  struct Target {
    DbcMessage* message;
    DbcSignal* signal;
  };

  // The signal that a statement behind the messages speaks of; null for orphans.
  Target target(const char* keyword) {
    const int line = scanner_.line();
    const auto raw_id = scanner_.number<std::uint32_t>("a message identifier");
    const std::string name(scanner_.word("a signal name"));
    const bool extended = (raw_id & extended_flag) != 0;
    for (DbcMessage& message : messages_) {
      if (message.id != (raw_id & ~extended_flag) || message.extended != extended) continue;
      for (DbcSignal& signal : message.signals)
        if (signal.name == name) return {&message, &signal};
      scanner_.refuse_at(
          line, std::string(keyword) + ": " + message.name + " has no signal '" + name + "'");
    }
    if (raw_id == 0xC0000000U) return {nullptr, nullptr};
    scanner_.refuse_at(line, std::string(keyword) + " " + name + ": there is no message " +
                                 std::to_string(raw_id));
  }

  void value_type() {
    const int line = scanner_.line();
    const Target found = target("SIG_VALTYPE_");
    scanner_.take(':');
    const auto type = scanner_.number<unsigned>("the value type, 0 to 2");
    scanner_.expect(';', "after the value type");
    if (type > 2)
      scanner_.refuse_at(line, "SIG_VALTYPE_: type " + std::to_string(type) +
                                   "; it is 0 (integer), 1 (float32) or 2 (float64)");
    if (found.signal == nullptr || type == 0) return;
    found.signal->signal.encoding = type == 1 ? Encoding::float32 : Encoding::float64;
    check_signal(*found.message, *found.signal, line);
  }

  void multiplex_values() {
    const Target found = target("SG_MUL_VAL_");
    const std::string multiplexor(scanner_.word("the name of the multiplexor"));
    const auto low = scanner_.number<std::uint64_t>("a multiplexor value");
    scanner_.expect('-', "in the range of multiplexor values");
    const auto high = scanner_.number<std::uint64_t>("a multiplexor value");
    const bool more = scanner_.take(',');
    scanner_.skip_statement();
    if (found.signal == nullptr) return;
    found.signal->multiplexor = multiplexor;
    found.signal->multiplexed_by = low;
    found.signal->has_multiplex_ranges = more || low != high;
  }

  DbcScanner scanner_;
  std::vector<DbcMessage> messages_;
  bool in_orphans_ = false;
};

}  // namespace

std::vector<DbcMessage> parse_dbc(std::string_view text, const std::string& file_name) {
  return Parser(text, file_name).parse();
}

}  // namespace sinerig::can
