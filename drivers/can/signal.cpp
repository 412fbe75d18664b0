#include "drivers/can/signal.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <sstream>
#include <stdexcept>

namespace sinerig::can {
namespace {

// Where bit `n` of the raw number is, counted from the least significant one.
unsigned position_of(const Signal& signal, unsigned n) noexcept {
  if (signal.order == ByteOrder::intel) return signal.start_bit + n;
  const unsigned from_msb = signal.length - 1U - n;
  const unsigned start_byte = signal.start_bit / 8U;
  const unsigned down = 7U - signal.start_bit % 8U + from_msb;
  return (start_byte + down / 8U) * 8U + (7U - down % 8U);
}

unsigned last_byte_of(const Signal& signal) noexcept {
  const unsigned lsb = position_of(signal, 0) / 8U;
  const unsigned msb = position_of(signal, signal.length - 1U) / 8U;
  return std::max(lsb, msb);
}

std::uint64_t mask_of(const Signal& signal) noexcept {
  return signal.length == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << signal.length) - 1U;
}

std::int64_t sign_extend(const Signal& signal, std::uint64_t raw) noexcept {
  const unsigned unused = 64U - signal.length;
  return std::bit_cast<std::int64_t>(raw << unused) >> unused;
}

double number_of(const Signal& signal, std::uint64_t raw) noexcept {
  switch (signal.encoding) {
    case Encoding::unsigned_integer: return static_cast<double>(raw);
    case Encoding::signed_integer: return static_cast<double>(sign_extend(signal, raw));
    case Encoding::float32: return std::bit_cast<float>(static_cast<std::uint32_t>(raw));
    case Encoding::float64: return std::bit_cast<double>(raw);
  }
  return 0.0;
}

// The limits are compared as doubles: 2^63 and 2^64 are doubles, the largest integers below are
// not.
std::uint64_t nearest_code(const Signal& signal, double number) noexcept {
  const double rounded = std::nearbyint(number);
  if (signal.encoding == Encoding::unsigned_integer) {
    if (!(rounded > 0.0)) return 0;
    if (rounded >= std::ldexp(1.0, signal.length)) return mask_of(signal);
    return static_cast<std::uint64_t>(rounded);
  }
  const double bound = std::ldexp(1.0, signal.length - 1);
  const std::uint64_t most_positive = mask_of(signal) >> 1U;
  if (rounded >= bound) return most_positive;
  if (rounded < -bound) return most_positive + 1U;
  return std::bit_cast<std::uint64_t>(static_cast<std::int64_t>(rounded)) & mask_of(signal);
}

std::uint64_t raw_of(const Signal& signal, double number) noexcept {
  switch (signal.encoding) {
    case Encoding::float32: {
      const double largest = std::numeric_limits<float>::max();
      const double bounded = std::clamp(number, -largest, largest);
      return std::bit_cast<std::uint32_t>(static_cast<float>(bounded));
    }
    case Encoding::float64: return std::bit_cast<std::uint64_t>(number);
    case Encoding::unsigned_integer:
    case Encoding::signed_integer: break;
  }
  return nearest_code(signal, number);
}

[[noreturn]] void refuse(const Signal& signal, const std::string& rule) {
  throw std::invalid_argument("signal at " + describe(signal) + ": " + rule);
}

}  // namespace

std::string describe(const Signal& signal) {
  static constexpr const char* names[] = {"unsigned", "signed", "float32", "float64"};
  std::ostringstream text;
  text << "bits " << signal.start_bit << '|' << int{signal.length}
       << (signal.order == ByteOrder::intel ? " Intel, " : " Motorola, ")
       << names[static_cast<int>(signal.encoding)] << ", scale " << signal.scale << ", offset "
       << signal.offset;
  return text.str();
}

bool fits(const Signal& signal, std::size_t payload_bytes) noexcept {
  return signal.length >= 1 && signal.length <= 64 && last_byte_of(signal) < payload_bytes;
}

void check(const Signal& signal, std::size_t payload_bytes) {
  if (signal.length < 1 || signal.length > 64) refuse(signal, "length must be 1 to 64 bits");
  if (signal.encoding == Encoding::float32 && signal.length != 32)
    refuse(signal, "a float32 is 32 bits long");
  if (signal.encoding == Encoding::float64 && signal.length != 64)
    refuse(signal, "a float64 is 64 bits long");
  if (!fits(signal, payload_bytes))
    refuse(signal, "reaches into byte " + std::to_string(last_byte_of(signal)) +
                       " of a payload of " + std::to_string(payload_bytes) +
                       " bytes (Motorola signals start at their most " +
                       "significant bit and grow towards higher bytes)");
  if (!std::isfinite(signal.scale) || signal.scale == 0.0)
    refuse(signal, "scale must be finite and not 0");
  if (!std::isfinite(signal.offset)) refuse(signal, "offset must be finite");
  if (!(signal.minimum <= signal.maximum)) refuse(signal, "minimum must not be above maximum");
  if (!std::isfinite(signal.wrap_modulus) || signal.wrap_modulus < 0.0)
    refuse(signal, "wrap modulus must be 0 (none) or positive");
}

std::uint64_t extract_raw(std::span<const std::uint8_t> payload, const Signal& signal) noexcept {
  std::uint64_t raw = 0;
  for (unsigned n = 0; n < signal.length; ++n) {
    const unsigned position = position_of(signal, n);
    const std::uint64_t bit = (std::uint64_t{payload[position / 8U]} >> (position % 8U)) & 1U;
    raw |= bit << n;
  }
  return raw;
}

void insert_raw(std::span<std::uint8_t> payload, const Signal& signal, std::uint64_t raw) noexcept {
  for (unsigned n = 0; n < signal.length; ++n) {
    const unsigned position = position_of(signal, n);
    const auto bit = static_cast<std::uint8_t>(1U << (position % 8U));
    std::uint8_t& byte = payload[position / 8U];
    byte = static_cast<std::uint8_t>((raw >> n) & 1U ? byte | bit : byte & ~bit);
  }
}

double decode(std::span<const std::uint8_t> payload, const Signal& signal) noexcept {
  return number_of(signal, extract_raw(payload, signal)) * signal.scale + signal.offset;
}

double encode(std::span<std::uint8_t> payload, const Signal& signal, double value) noexcept {
  const double wanted = std::isnan(value) ? 0.0 : value;
  const double clamped = std::clamp(wanted, signal.minimum, signal.maximum);
  const std::uint64_t raw = raw_of(signal, (clamped - signal.offset) / signal.scale);
  insert_raw(payload, signal, raw);
  return number_of(signal, raw) * signal.scale + signal.offset;
}

}  // namespace sinerig::can
