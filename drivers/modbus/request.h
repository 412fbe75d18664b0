// Requests and replies of the Modbus application protocol (specification V1.1b3) without what a
// transport puts around them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace sinerig::modbus {

enum class Function : std::uint8_t {
  read_holding = 3,
  read_input = 4,
  write_single = 6,
  write_multiple = 16,
  write_and_read = 23,
};

enum class Table : std::uint8_t { holding, input };

inline constexpr std::size_t max_read_registers = 125;
inline constexpr std::size_t max_written_registers = 121;  // the least of functions 16 and 23

// What a request asks of a device: registers written, registers read, or both (written first).
struct Request {
  std::uint8_t unit = 1;
  Function function = Function::read_holding;
  std::uint16_t read_address = 0;
  std::uint16_t read_count = 0;
  std::uint16_t write_address = 0;
  std::uint16_t write_count = 0;
  std::array<std::uint16_t, 4> words{};  // to be written; one number is the most that ever is

  // Registers behind those wanted that the device lets read: answers of different lengths tell
  // which question they belong to.
  std::uint16_t spare = 0;

  bool reads() const noexcept { return read_count > 0; }
  bool writes() const noexcept { return write_count > 0; }
};

// Unit identifier, function code and data; at most 21 bytes here.
struct RequestBytes {
  std::array<std::uint8_t, 32> data{};
  std::size_t size = 0;
  std::span<const std::uint8_t> bytes() const noexcept { return {data.data(), size}; }
};

RequestBytes bytes_of(const Request& request) noexcept;

// Length of the reply's function code and data when it is no exception.
std::size_t reply_size(const Request& request) noexcept;

enum class ReplyKind : std::uint8_t { matches, exception, other };

struct Reply {
  ReplyKind kind = ReplyKind::other;
  std::uint8_t exception = 0;
};

// Whether `pdu` (function code and data) answers `request`; copies the registers that it brings.
Reply read_reply(std::span<const std::uint8_t> pdu, const Request& request,
                 std::span<std::uint16_t> registers) noexcept;

// 2 → "exception 2, illegal data address"
std::string exception_text(std::uint8_t code);

// Check sum of serial frames: polynomial 0xA001 (reflected), initially 0xFFFF; sent low byte first.
std::uint16_t crc16(std::span<const std::uint8_t> bytes) noexcept;

}  // namespace sinerig::modbus
