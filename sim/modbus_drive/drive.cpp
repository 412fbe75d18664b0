#include "sim/modbus_drive/drive.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace sinerig::sim {
namespace {

constexpr std::size_t control_at = 0;
constexpr std::size_t set_point_at = 16;
constexpr std::size_t state_at = 32;
constexpr std::size_t error_at = 33;
constexpr std::size_t position_at = 34;
constexpr std::size_t velocity_at = 38;
constexpr std::size_t torque_at = 42;

constexpr std::uint8_t illegal_function = 1;
constexpr std::uint8_t illegal_address = 2;
constexpr std::uint8_t illegal_value = 3;

std::size_t word(std::span<const std::uint8_t> bytes, std::size_t at) {
  return bytes[at] * std::size_t{256} + bytes[at + 1];
}

Bytes refusal(std::uint8_t function, std::uint8_t exception) {
  return {static_cast<std::uint8_t>(function + 128), exception};
}

// The bytes of a number, most significant first, as the machine's memory has them reversed.
template <class Number>
Bytes big_endian(Number number) {
  Bytes bytes(sizeof number);
  std::memcpy(bytes.data(), &number, sizeof number);
  std::ranges::reverse(bytes);
  return bytes;
}

template <class Number>
Number from_big_endian(Bytes bytes) {
  std::ranges::reverse(bytes);
  Number number;
  std::memcpy(&number, bytes.data(), sizeof number);
  return number;
}

template <class Integer>
Bytes rounded(double code) {
  const auto low = static_cast<double>(std::numeric_limits<Integer>::min());
  const auto high = static_cast<double>(std::numeric_limits<Integer>::max());
  return big_endian(static_cast<Integer>(std::lround(std::clamp(code, low, high))));
}

Bytes encoded(const std::string& type, double code) {
  if (type == "int16") return rounded<std::int16_t>(code);
  if (type == "uint16") return rounded<std::uint16_t>(code);
  if (type == "int32") return rounded<std::int32_t>(code);
  if (type == "uint32") return rounded<std::uint32_t>(code);
  if (type == "float64") return big_endian(code);
  return big_endian(static_cast<float>(code));
}

double decoded(const std::string& type, const Bytes& bytes) {
  if (type == "int16") return from_big_endian<std::int16_t>(bytes);
  if (type == "uint16") return from_big_endian<std::uint16_t>(bytes);
  if (type == "int32") return from_big_endian<std::int32_t>(bytes);
  if (type == "uint32") return from_big_endian<std::uint32_t>(bytes);
  if (type == "float64") return from_big_endian<double>(bytes);
  return static_cast<double>(from_big_endian<float>(bytes));
}

std::size_t bytes_in(const std::string& type) {
  if (type == "int16" || type == "uint16") return 2;
  return type == "float64" ? 8 : 4;
}

}  // namespace

Drive::Drive(const DriveSettings& settings, std::int64_t start_ns)
    : settings_{settings}, motor_{settings.system, start_ns}, last_request_ns_{start_ns} {}

void Drive::put(std::size_t first, double value, double scale) {
  Bytes bytes = encoded(settings_.type, value / scale);
  const std::size_t words = bytes.size() / 2;
  for (std::size_t n = 0; n < words; ++n) {
    std::uint8_t high = bytes[2 * n];
    std::uint8_t low = bytes[2 * n + 1];
    if (settings_.low_byte_first) std::swap(high, low);
    const std::size_t at = settings_.low_word_first ? words - 1 - n : n;
    registers_[first + at] = static_cast<std::uint16_t>(high * 256 + low);
  }
}

double Drive::get(std::size_t first, double scale) const {
  Bytes bytes(bytes_in(settings_.type));
  const std::size_t words = bytes.size() / 2;
  for (std::size_t n = 0; n < words; ++n) {
    const std::size_t at = settings_.low_word_first ? words - 1 - n : n;
    auto high = static_cast<std::uint8_t>(registers_[first + at] / 256);
    auto low = static_cast<std::uint8_t>(registers_[first + at] % 256);
    if (settings_.low_byte_first) std::swap(high, low);
    bytes[2 * n] = high;
    bytes[2 * n + 1] = low;
  }
  return decoded(settings_.type, bytes) * scale;
}

void Drive::become(State state, std::int64_t time_ns) {
  if (state == state_) return;
  state_ = state;
  if (changes_.size() == most_changes) return;
  changes_.push_back(
      {.time_ns = time_ns, .state = state, .set_point = get(set_point_at, settings_.torque_scale)});
}

void Drive::lose_power(std::int64_t now_ns) {
  stop(off, none, now_ns);
  registers_.fill(0);
}

void Drive::stop(State state, std::uint16_t error, std::int64_t time_ns) {
  become(state, time_ns);
  error_ = error;
  motor_.apply(0.0, time_ns);
}

void Drive::watch(std::int64_t now_ns) {
  if (settings_.watchdog_s <= 0.0 || state_ != on_) return;
  if (static_cast<double>(now_ns - last_request_ns_) * 1e-9 > settings_.watchdog_s)
    stop(tripped, watchdog, now_ns);
}

bool Drive::writable(std::size_t first, std::size_t words) const {
  const bool is_control = first == control_at && words == 1;
  const bool is_set_point = first == set_point_at && 2 * words == bytes_in(settings_.type);
  return is_control || is_set_point;
}

std::uint8_t Drive::write(std::size_t first, std::span<const std::uint8_t> words,
                          std::int64_t time_ns) {
  if (!writable(first, words.size() / 2)) return illegal_address;
  for (std::size_t n = 0; n < words.size() / 2; ++n)
    registers_[first + n] = static_cast<std::uint16_t>(word(words, 2 * n));
  if (first == control_at) {
    if (registers_[control_at] > 2) return illegal_value;
    if (registers_[control_at] == 0) stop(state_ == tripped ? tripped : off, error_, time_ns);
    if (registers_[control_at] == 1 && state_ == off) become(on_, time_ns);
    if (registers_[control_at] == 2 && state_ == tripped) stop(off, none, time_ns);
    return 0;
  }
  const double wanted = get(set_point_at, settings_.torque_scale);
  if (!std::isfinite(wanted)) return illegal_value;
  if (state_ == on_)
    motor_.apply(std::clamp(wanted, -settings_.torque_max, settings_.torque_max), time_ns);
  return 0;
}

void Drive::refresh(std::int64_t time_ns) {
  motor_.sample(time_ns);
  registers_[state_at] = state_;
  registers_[error_at] = error_;
  put(position_at, motor_.position(), settings_.position_scale);
  put(velocity_at, motor_.velocity(), settings_.velocity_scale);
  put(torque_at, motor_.torque(), settings_.torque_scale);
}

Bytes Drive::read(std::uint8_t function, std::size_t first, std::size_t words,
                  std::int64_t time_ns) {
  if (words < 1 || words > 125) return refusal(function, illegal_value);
  if (first + words > count) return refusal(function, illegal_address);
  refresh(time_ns);
  Bytes reply{function, static_cast<std::uint8_t>(2 * words)};
  for (std::size_t n = 0; n < words; ++n) {
    reply.push_back(static_cast<std::uint8_t>(registers_[first + n] / 256));
    reply.push_back(static_cast<std::uint8_t>(registers_[first + n] % 256));
  }
  return reply;
}

Bytes Drive::answer(std::span<const std::uint8_t> pdu, std::int64_t time_ns) {
  watch(time_ns);
  last_request_ns_ = time_ns;
  const std::uint8_t function = pdu[0];
  const auto echo = [&] {
    return Bytes(pdu.begin(), pdu.begin() + 5);
  };
  switch (function) {
    case 3:
    case 4:
      if (pdu.size() != 5) return refusal(function, illegal_value);
      return read(function, word(pdu, 1), word(pdu, 3), time_ns);
    case 6: {
      if (pdu.size() != 5) return refusal(function, illegal_value);
      const std::uint8_t wrong = write(word(pdu, 1), pdu.subspan(3, 2), time_ns);
      return wrong == 0 ? echo() : refusal(function, wrong);
    }
    case 16: {
      if (!settings_.has_function_16) return refusal(function, illegal_function);
      if (pdu.size() < 6 || pdu[5] != 2 * word(pdu, 3) || pdu.size() != 6U + pdu[5])
        return refusal(function, illegal_value);
      const std::uint8_t wrong = write(word(pdu, 1), pdu.subspan(6), time_ns);
      return wrong == 0 ? echo() : refusal(function, wrong);
    }
    case 23: {
      if (!settings_.has_function_23) return refusal(function, illegal_function);
      if (pdu.size() < 10 || pdu[9] != 2 * word(pdu, 7) || pdu.size() != 10U + pdu[9])
        return refusal(function, illegal_value);
      const std::uint8_t wrong = write(word(pdu, 5), pdu.subspan(10), time_ns);
      if (wrong != 0) return refusal(function, wrong);
      return read(function, word(pdu, 1), word(pdu, 3), time_ns);
    }
    default: return refusal(function, illegal_function);
  }
}

}  // namespace sinerig::sim
