#include "drivers/modbus/registers.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace sinerig::modbus {
namespace {

std::uint16_t in_byte_order(std::uint16_t word, Order bytes) noexcept {
  return bytes == Order::high_first ? word : static_cast<std::uint16_t>(word << 8U | word >> 8U);
}

std::uint64_t gather(std::span<const std::uint16_t> registers, const Format& format) noexcept {
  const std::size_t count = words_of(format.type);
  std::uint64_t raw = 0;
  for (std::size_t n = 0; n < count; ++n) {
    const std::size_t from = format.words == Order::high_first ? n : count - 1 - n;
    raw = raw << 16U | in_byte_order(registers[from], format.bytes);
  }
  return raw;
}

void scatter(std::span<std::uint16_t> registers, const Format& format, std::uint64_t raw) noexcept {
  const std::size_t count = words_of(format.type);
  for (std::size_t n = 0; n < count; ++n) {
    const std::size_t to = format.words == Order::low_first ? n : count - 1 - n;
    registers[to] = in_byte_order(static_cast<std::uint16_t>(raw >> (16U * n)), format.bytes);
  }
}

template <class Integer>
std::uint64_t nearest(double code, double& meant) noexcept {
  constexpr auto lowest = static_cast<double>(std::numeric_limits<Integer>::min());
  constexpr auto highest = static_cast<double>(std::numeric_limits<Integer>::max());
  meant = std::clamp(std::nearbyint(code), lowest, highest);
  return static_cast<std::uint64_t>(static_cast<std::int64_t>(meant));
}

}  // namespace

Span span_of(const Format& format) noexcept {
  const auto of_codes = [&](auto least, auto greatest) -> Span {
    const double one = static_cast<double>(least) * format.scale + format.offset;
    const double other = static_cast<double>(greatest) * format.scale + format.offset;
    return {.low = std::min(one, other), .high = std::max(one, other)};
  };
  const auto of_integers = [&]<class Integer>(Integer) {
    return of_codes(std::numeric_limits<Integer>::min(), std::numeric_limits<Integer>::max());
  };
  switch (format.type) {
    case RegisterType::int16: return of_integers(std::int16_t{});
    case RegisterType::uint16: return of_integers(std::uint16_t{});
    case RegisterType::int32: return of_integers(std::int32_t{});
    case RegisterType::uint32: return of_integers(std::uint32_t{});
    case RegisterType::float32:
    case RegisterType::float64: break;
  }
  constexpr double infinite = std::numeric_limits<double>::infinity();
  return {.low = -infinite, .high = infinite};
}

double decode(std::span<const std::uint16_t> registers, const Format& format) noexcept {
  const std::uint64_t raw = gather(registers, format);
  double code = 0.0;
  switch (format.type) {
    case RegisterType::int16: code = static_cast<std::int16_t>(raw); break;
    case RegisterType::uint16:
    case RegisterType::uint32: code = static_cast<double>(raw); break;
    case RegisterType::int32: code = static_cast<std::int32_t>(raw); break;
    case RegisterType::float32: code = std::bit_cast<float>(static_cast<std::uint32_t>(raw)); break;
    case RegisterType::float64: code = std::bit_cast<double>(raw); break;
  }
  return code * format.scale + format.offset;
}

double encode(std::span<std::uint16_t> registers, const Format& format, double value) noexcept {
  const double code = (value - format.offset) / format.scale;
  double meant = code;
  std::uint64_t raw = 0;
  switch (format.type) {
    case RegisterType::int16: raw = nearest<std::int16_t>(code, meant); break;
    case RegisterType::uint16: raw = nearest<std::uint16_t>(code, meant); break;
    case RegisterType::int32: raw = nearest<std::int32_t>(code, meant); break;
    case RegisterType::uint32: raw = nearest<std::uint32_t>(code, meant); break;
    case RegisterType::float32: {
      constexpr auto largest = static_cast<double>(std::numeric_limits<float>::max());
      const auto rounded = static_cast<float>(std::clamp(code, -largest, largest));
      raw = std::bit_cast<std::uint32_t>(rounded);
      meant = static_cast<double>(rounded);
      break;
    }
    case RegisterType::float64:
      meant = std::clamp(code, std::numeric_limits<double>::lowest(),
                         std::numeric_limits<double>::max());
      raw = std::bit_cast<std::uint64_t>(meant);
      break;
  }
  scatter(registers, format, raw);
  return meant * format.scale + format.offset;
}

}  // namespace sinerig::modbus
