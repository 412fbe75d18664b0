// One number inside a payload: where its bits are and what they mean.
//
// Bits are numbered as in DBC files: bit n is bit n % 8 (0 = least significant) of byte n / 8.
// Intel signals start at their least significant bit and grow upwards. Motorola signals start at
// their most significant bit and go down through the byte, then on to bit 7 of the next byte
// (sawtooth).
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string>

#include "drivers/unwrapper.h"

namespace sinerig::can {

enum class ByteOrder : std::uint8_t { intel, motorola };
enum class Encoding : std::uint8_t { unsigned_integer, signed_integer, float32, float64 };

struct Signal {
  std::uint16_t start_bit = 0;
  std::uint8_t length = 8;  // bits, 1…64; 32 for float32, 64 for float64
  ByteOrder order = ByteOrder::intel;
  Encoding encoding = Encoding::unsigned_integer;
  double scale = 1.0;  // value = raw · scale + offset
  double offset = 0.0;
  double minimum =
      -std::numeric_limits<double>::infinity();              // a command is clamped to these before
  double maximum = std::numeric_limits<double>::infinity();  // it is encoded
  double wrap_modulus =
      0.0;  // > 0: the value is an angle that wraps after this much; see Unwrapper

  friend bool operator==(const Signal&, const Signal&) = default;
};

// Throws std::invalid_argument with the rule that `signal` breaks in a payload of `payload_bytes`.
void check(const Signal& signal, std::size_t payload_bytes);

// One line for people: "bits 7|16 Motorola, unsigned, scale 0.00038, offset -12.5".
std::string describe(const Signal& signal);

// True when every bit of the signal lies in the payload. The functions below demand it.
bool fits(const Signal& signal, std::size_t payload_bytes) noexcept;

std::uint64_t extract_raw(std::span<const std::uint8_t> payload, const Signal& signal) noexcept;
void insert_raw(std::span<std::uint8_t> payload, const Signal& signal, std::uint64_t raw) noexcept;

// The value, in the signal's unit. A float signal can be infinite or not a number.
double decode(std::span<const std::uint8_t> payload, const Signal& signal) noexcept;

// Clamps `value`, rounds it to the nearest code, and writes the bits. Returns the value that those
// bits mean, which is what the device will apply. Not a number is encoded as the code nearest to 0.
double encode(std::span<std::uint8_t> payload, const Signal& signal, double value) noexcept;

}  // namespace sinerig::can
