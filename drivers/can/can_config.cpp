#include "drivers/can/can_config.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <filesystem>
#include <sstream>
#include <utility>

namespace sinerig::can {
namespace {

using config::any_number;
using config::Range;
using config::zero_or_more;

constexpr Range a_payload_position{.min = 0.0, .max = max_fd_bytes - 1};

void convert_to_unit_of(const config::Section& section, Signal& signal) {
  const double factor = section.number("unit_scale", any_number, 1.0);
  if (factor == 0.0) section.refuse("unit_scale", "must not be 0");
  signal.scale *= factor;
  signal.offset *= factor;
  signal.minimum *= factor;
  signal.maximum *= factor;
  if (factor < 0.0) std::swap(signal.minimum, signal.maximum);
  signal.wrap_modulus *= std::abs(factor);
  signal.minimum = section.number("clamp_min", any_number, signal.minimum);
  signal.maximum = section.number("clamp_max", any_number, signal.maximum);
  signal.wrap_modulus = section.number("wrap", zero_or_more, signal.wrap_modulus);
}

}  // namespace

bool is_held(const Signal& signal, double value, double held) {
  const bool is_float =
      signal.encoding == Encoding::float32 || signal.encoding == Encoding::float64;
  const double rounding = is_float ? 1e-6 * (std::abs(value) + std::abs(signal.offset))
                                   : 0.500001 * std::abs(signal.scale);
  return std::abs(held - value) <= rounding;
}

const Dbc& ConfigReader::dbc(const Keys& keys) {
  const Keys& holder = holder_of("dbc", keys);
  if (!holder.has("dbc"))
    keys.refuse("signal", "is a name in a DBC file; give the file with dbc = \"…\"");
  const std::filesystem::path named = holder.at("dbc").text("dbc");
  const std::string path = (std::filesystem::path(holder.folder_of("dbc")) / named).string();
  const auto known = dbcs_.find(path);
  if (known != dbcs_.end()) return known->second;
  return at_key(holder, "dbc", [&]() -> const Dbc& {
    const Dbc& read = dbcs_.emplace(path, Dbc::read_file(path)).first->second;
    holder.at("dbc").include(path);
    return read;
  });
}

// 29 bit where it says so, or where it needs them and the device goes by that.
bool ConfigReader::is_extended(const Keys& keys, std::string_view key, std::uint32_t id,
                               std::string_view step_key) const {
  if (keys.has(key)) return keys.at(key).flag(key, false);
  const Keys& holder = holder_of("extended_by_id", keys);
  return holder.at("extended_by_id").flag("extended_by_id", false) &&
         moved(keys, id, step_key) > max_standard_id;
}

std::uint64_t ConfigReader::moved(const Keys& keys, std::uint32_t id,
                                  std::string_view step_key) const {
  const std::string_view given = keys.has(step_key) ? step_key : "node_step";
  return id +
         static_cast<std::uint64_t>(holder_of(given, keys).integer(given, an_id, 0)) * steps(keys);
}

// A frame that holds the set-points of several nodes, from node 1 on: how many such frames this
// node's is behind the first, and which place it has there. A rig file that gives the identifier or
// the place itself has counted already.
std::uint32_t ConfigReader::steps(const Keys& keys) const {
  if (!keys.has("nodes_per_frame")) return node_;
  const auto nodes =
      static_cast<std::uint32_t>(keys.integer("nodes_per_frame", {.min = 1.0, .max = 64.0}));
  return keys.over() && keys.over()->has("id") ? 0 : (std::max(node_, 1U) - 1U) / nodes;
}

std::uint32_t ConfigReader::index_in_frame(const Keys& keys) const {
  if (!keys.has("nodes_per_frame")) return 0;
  const auto nodes =
      static_cast<std::uint32_t>(keys.integer("nodes_per_frame", {.min = 1.0, .max = 64.0}));
  return keys.over() && keys.over()->has("start_bit") ? 0 : (std::max(node_, 1U) - 1U) % nodes;
}

std::uint32_t ConfigReader::shifted(const Keys& keys, std::string_view key, std::uint32_t id,
                                    bool extended, std::string_view step_key) const {
  const std::uint64_t shifted_id = moved(keys, id, step_key);
  const std::uint32_t highest = extended ? max_extended_id : max_standard_id;
  if (shifted_id > highest)
    keys.refuse(key, "identifier " + std::to_string(shifted_id) +
                         " (with node_step · node added) is above " + id_text(highest, extended) +
                         (extended ? "" : "; extended = true makes it a 29-bit one"));
  return static_cast<std::uint32_t>(shifted_id);
}

Frame ConfigReader::frame_of_message(const Keys& keys, const DbcMessage& message) const {
  Frame frame;
  frame.extended = message.extended;
  frame.id = shifted(keys, "signal", message.id, message.extended);
  frame.length = message.length;
  frame.fd = keys.at("fd").flag("fd", message.length > max_classic_bytes);
  frame.bit_rate_switch = frame.fd && keys.at("bit_rate_switch").flag("bit_rate_switch", false);
  return frame;
}

// A frame given in place: id, bytes or length, flags.
Frame ConfigReader::frame(const Keys& keys) {
  Frame frame;
  if (keys.at("answer").flag("answer", false)) {
    frame.id = static_cast<std::uint32_t>(keys.integer("id", an_id, answer_id_));
    frame.extended = keys.at("extended").flag("extended", frame.id > max_standard_id);
  } else {
    const auto id = static_cast<std::uint32_t>(keys.integer("id", an_id));
    frame.extended = is_extended(keys, "extended", id, "node_step");
    frame.id = shifted(keys, "id", id, frame.extended);
  }
  frame.fd = keys.at("fd").flag("fd", false);
  frame.bit_rate_switch = frame.fd && keys.at("bit_rate_switch").flag("bit_rate_switch", false);
  frame.remote = keys.at("remote").flag("remote", false);
  std::vector<double> bytes;
  if (keys.has("bytes")) bytes = keys.at("bytes").numbers("bytes", a_byte);
  const double longest = frame.fd ? max_fd_bytes : max_classic_bytes;
  if (static_cast<double>(bytes.size()) > longest)
    keys.refuse("bytes", "a classic frame has up to 8 bytes; CAN-FD (fd = true) up to 64");
  frame.length = static_cast<std::uint8_t>(keys.integer("length", {.min = 0.0, .max = longest},
                                                        static_cast<std::int64_t>(bytes.size())));
  if (frame.length < bytes.size()) keys.refuse("length", "is shorter than bytes");
  std::ranges::transform(bytes, frame.data.begin(),
                         [](double byte) { return static_cast<std::uint8_t>(byte); });
  at_key(keys, "id", [&] { check(frame); });
  return frame;
}

Signal ConfigReader::layout(const Keys& keys) const {
  Signal signal;
  const std::string type = keys.at("type").choice("type", {"uint", "int", "float32", "float64"});
  if (type == "int") signal.encoding = Encoding::signed_integer;
  if (type == "float32") signal.encoding = Encoding::float32;
  if (type == "float64") signal.encoding = Encoding::float64;
  if (keys.at("order").choice("order", {"intel", "motorola"}) == "motorola")
    signal.order = ByteOrder::motorola;
  signal.start_bit =
      static_cast<std::uint16_t>(keys.integer("start_bit", {.min = 0.0, .max = 511.0}));
  if (keys.has("nodes_per_frame")) {
    const std::int64_t apart = keys.integer("bits_per_node", {.min = 1.0, .max = 64.0});
    signal.start_bit = static_cast<std::uint16_t>(signal.start_bit + apart * index_in_frame(keys));
  }
  const std::int64_t usual_bits = type == "float64" ? 64 : type == "float32" ? 32 : 16;
  signal.length =
      static_cast<std::uint8_t>(keys.integer("bits", {.min = 1.0, .max = 64.0}, usual_bits));
  if (!keys.has("range")) {
    signal.scale = keys.number("scale", any_number, 1.0);
    signal.offset = keys.number("offset", any_number, 0.0);
    return signal;
  }
  const std::vector<double> ends = keys.at("range").numbers("range", any_number);
  if (ends.size() != 2 || !(ends[0] < ends[1]) || type != "uint")
    keys.refuse("range", "must be [value of code 0, value of the highest code] of a \"uint\"");
  signal.scale = (ends[1] - ends[0]) / (std::ldexp(1.0, signal.length) - 1.0);
  signal.offset = ends[0];
  return signal;
}

// `unit_scale` turns what the frame holds into the profile's unit and the rig's into the rig's: the
// factors multiply. Clamps and wrap are in the unit of the file that gives them.
void ConfigReader::convert_unit(const Keys& keys, Signal& signal) const {
  convert_to_unit_of(keys.base(), signal);
  if (!keys.over()) return;
  const config::Section& rig = *keys.over();
  const bool converted = rig.has("unit_scale") && rig.number("unit_scale", any_number) != 1.0;
  if (rig.has("unit") && keys.base().has("unit") && !converted &&
      rig.text("unit") != keys.base().text("unit"))
    rig.refuse("unit", "the profile's is \"" + keys.base().text("unit") +
                           "\"; give unit_scale: how many of this unit are one of the profile's");
  convert_to_unit_of(rig, signal);
}

ConfigReader::Place ConfigReader::place_by_name(const Keys& keys) {
  const Dbc& database = dbc(keys);
  const std::string name = keys.at("signal").text("signal");
  const DbcBinding binding = at_key(keys, "signal", [&] { return database.find(name); });
  Place place;
  place.frame = frame_of_message(keys, *binding.message);
  place.signal = binding.signal->signal;
  place.origin = origin_of(binding);
  for (const auto& [multiplexor, raw] : binding.multiplexors) {
    place.pattern.require(multiplexor->signal, raw);
    insert_raw(place.frame.payload(), multiplexor->signal, raw);
  }
  return place;
}

ConfigReader::Place ConfigReader::place_by_layout(const Keys& keys) {
  Place place;
  place.signal = layout(keys);
  place.frame = frame(keys);
  return place;
}

ConfigReader::Place ConfigReader::place(const Keys& keys) {
  Place place = keys.has("signal") ? place_by_name(keys) : place_by_layout(keys);
  convert_unit(keys, place.signal);
  place.pattern.id = place.frame.id;
  place.pattern.extended = place.frame.extended;
  return place;
}

// Constant signals of a frame: set = [{ signal = "…" or start_bit, bits, …, value }, …].
void ConfigReader::fill(const Keys& keys, Frame& frame, bool by_name) {
  for (const Keys& entry : keys.tables("set")) {
    Signal signal;
    if (by_name) {
      const std::string name = entry.at("signal").text("signal");
      const DbcBinding binding = at_key(entry, "signal", [&] { return dbc(keys).find(name); });
      if (shifted(keys, "set", binding.message->id, binding.message->extended) != frame.id)
        entry.refuse("signal", "is in another message than the signals before it");
      signal = binding.signal->signal;
      for (const auto& [multiplexor, raw] : binding.multiplexors)
        insert_raw(frame.payload(), multiplexor->signal, raw);
    } else {
      signal = layout(entry);
      at_key(entry, "start_bit", [&] { check(signal, frame.length); });
    }
    put_value(entry, "value", frame, signal);
  }
}

// Rounded to the nearest code; one that is not near is a mistake, not a set-point to be clamped.
double ConfigReader::put_value(const Keys& entry, std::string_view key, Frame& frame,
                               const Signal& signal) {
  const double value = entry.at(key).number(key, any_number);
  const double held = encode(frame.payload(), signal, value);
  if (!is_held(signal, value, held)) {
    std::ostringstream rule;
    rule << "is outside what the signal can hold: " << held << " is the nearest";
    entry.refuse(key, rule.str());
  }
  return held;
}

Checksum ConfigReader::checksum(const Keys& keys, std::size_t bytes) const {
  Checksum checksum;
  const std::string kind = keys.at("checksum").choice("checksum", {"none", "sum8", "xor8", "crc8"});
  if (kind == "none") return checksum;
  checksum.kind = kind == "sum8"   ? Checksum::Kind::sum8
                  : kind == "xor8" ? Checksum::Kind::xor8
                                   : Checksum::Kind::crc8;
  const auto byte = [&](std::string_view key, Range range, std::size_t fallback) {
    return static_cast<std::uint8_t>(keys.integer(key, range, static_cast<std::int64_t>(fallback)));
  };
  const std::size_t last = bytes > 0 ? bytes - 1 : 0;
  checksum.position = byte("checksum_byte", a_payload_position, last);
  checksum.first = byte("checksum_first", a_payload_position, 0);
  checksum.last = byte("checksum_last", a_payload_position, last);
  checksum.with_id = keys.at("checksum_with_id").flag("checksum_with_id", false);
  checksum.polynomial = byte("checksum_polynomial", a_byte, checksum.polynomial);
  checksum.initial = byte("checksum_initial", a_byte, checksum.initial);
  at_key(keys, "checksum", [&] { check(checksum, bytes); });
  return checksum;
}

// [[position, value], [position, value, mask]]
void ConfigReader::require_bytes(const Keys& keys, std::string_view key, Pattern& pattern) const {
  if (!keys.has(key)) return;
  for (const std::vector<double>& row : keys.at(key).rows(key, a_byte)) {
    if (row.size() < 2 || row.size() > 3 || row[0] >= static_cast<double>(max_fd_bytes))
      keys.refuse(key, "every row is [position, value] or [position, value, mask]");
    const double mask = row.size() == 3 ? row[2] : 255.0;
    pattern.require_byte(static_cast<std::size_t>(row[0]), static_cast<std::uint8_t>(row[1]),
                         static_cast<std::uint8_t>(mask));
  }
}

// [position, mask]: the node, or as much of it as the mask takes, in a byte of the frame.
void ConfigReader::require_node(const Keys& keys, Pattern& pattern) const {
  if (!keys.has("match_node")) return;
  const std::vector<double> given = keys.at("match_node").numbers("match_node", a_byte);
  if (given.size() != 2 || given[0] >= static_cast<double>(max_fd_bytes) || given[1] == 0.0)
    keys.refuse("match_node", "must be [position, mask]");
  const auto mask = static_cast<std::uint8_t>(given[1]);
  pattern.require_byte(static_cast<std::size_t>(given[0]),
                       static_cast<std::uint8_t>(node_ << std::countr_zero(mask)), mask);
}

}  // namespace sinerig::can
