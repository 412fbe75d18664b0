// Numbers in Modbus registers: 16-bit words, of which a longer number takes two or four, in an
// order that the standard leaves open. Own conversions: the float setters of libmodbus
// before 3.1.11 write another order than their names say.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace sinerig::modbus {

enum class RegisterType : std::uint8_t { int16, uint16, int32, uint32, float32, float64 };

// Of the words of a number, and of the two bytes in each word. Letters name the bytes of a 32-bit
// number from the most significant one: high, high = ABCD; low, high = CDAB; high, low = BADC;
// low, low = DCBA.
enum class Order : std::uint8_t { high_first, low_first };

// value = code · scale + offset
struct Format {
  RegisterType type = RegisterType::uint16;
  Order words = Order::high_first;
  Order bytes = Order::high_first;
  double scale = 1.0;
  double offset = 0.0;
};

inline constexpr std::size_t max_words = 4;

constexpr std::size_t words_of(RegisterType type) noexcept {
  switch (type) {
    case RegisterType::int16:
    case RegisterType::uint16: return 1;
    case RegisterType::int32:
    case RegisterType::uint32:
    case RegisterType::float32: return 2;
    case RegisterType::float64: return 4;
  }
  return 1;
}

// The value in words_of(format.type) registers. Not a number where a float register holds none.
double decode(std::span<const std::uint16_t> registers, const Format& format) noexcept;

// The least and the greatest value that the registers can say; infinite for floats.
struct Span {
  double low = 0.0;
  double high = 0.0;
};
Span span_of(const Format& format) noexcept;

// Writes the nearest code, at the end of the type's range where `value` lies beyond it, and returns
// what that code means. `value` must be a number.
double encode(std::span<std::uint16_t> registers, const Format& format, double value) noexcept;

}  // namespace sinerig::modbus
