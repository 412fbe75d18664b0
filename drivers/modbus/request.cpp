#include "drivers/modbus/request.h"

namespace sinerig::modbus {
namespace {

class Writer {
 public:
  explicit Writer(RequestBytes& bytes) : bytes_{bytes} {}
  void byte(std::size_t value) noexcept {
    bytes_.data[bytes_.size++] = static_cast<std::uint8_t>(value);
  }
  void word(std::size_t value) noexcept {
    byte(value >> 8U);
    byte(value & 0xFFU);
  }
  void registers(const Request& request) noexcept {
    byte(2U * request.write_count);
    for (std::size_t n = 0; n < request.write_count; ++n) word(request.words[n]);
  }

 private:
  RequestBytes& bytes_;
};

constexpr std::uint8_t exception_bit = 0x80;

std::uint16_t word_at(std::span<const std::uint8_t> bytes, std::size_t position) noexcept {
  return static_cast<std::uint16_t>(bytes[position] << 8U | bytes[position + 1]);
}

}  // namespace

RequestBytes bytes_of(const Request& request) noexcept {
  RequestBytes bytes;
  Writer write{bytes};
  write.byte(request.unit);
  write.byte(static_cast<std::size_t>(request.function));
  switch (request.function) {
    case Function::read_holding:
    case Function::read_input:
      write.word(request.read_address);
      write.word(request.read_count);
      break;
    case Function::write_single:
      write.word(request.write_address);
      write.word(request.words[0]);
      break;
    case Function::write_multiple:
      write.word(request.write_address);
      write.word(request.write_count);
      write.registers(request);
      break;
    case Function::write_and_read:
      write.word(request.read_address);
      write.word(request.read_count);
      write.word(request.write_address);
      write.word(request.write_count);
      write.registers(request);
      break;
  }
  return bytes;
}

std::size_t reply_size(const Request& request) noexcept {
  const bool acknowledges =
      request.function == Function::write_single || request.function == Function::write_multiple;
  return acknowledges ? 5U : 2U + 2U * request.read_count;
}

Reply read_reply(std::span<const std::uint8_t> pdu, const Request& request,
                 std::span<std::uint16_t> registers) noexcept {
  const auto function = static_cast<std::uint8_t>(request.function);
  if (pdu.size() == 2 && pdu[0] == (function | exception_bit))
    return {.kind = ReplyKind::exception, .exception = pdu[1]};
  if (pdu.size() != reply_size(request) || pdu[0] != function) return {};
  switch (request.function) {
    case Function::write_single:
      if (word_at(pdu, 1) != request.write_address || word_at(pdu, 3) != request.words[0])
        return {};
      break;
    case Function::write_multiple:
      if (word_at(pdu, 1) != request.write_address || word_at(pdu, 3) != request.write_count)
        return {};
      break;
    default:
      if (pdu[1] != 2U * request.read_count || registers.size() < request.read_count) return {};
      for (std::size_t n = 0; n < request.read_count; ++n) registers[n] = word_at(pdu, 2 + 2 * n);
  }
  return {.kind = ReplyKind::matches, .exception = 0};
}

std::string exception_text(std::uint8_t code) {
  static constexpr const char* names[] = {"",
                                          "illegal function",
                                          "illegal data address",
                                          "illegal data value",
                                          "device failure",
                                          "acknowledge",
                                          "device busy",
                                          "negative acknowledge",
                                          "memory parity error",
                                          "",
                                          "gateway path unavailable",
                                          "gateway target does not respond"};
  std::string text = "exception " + std::to_string(code);
  if (code < std::size(names) && *names[code] != '\0') text += std::string{", "} + names[code];
  return text;
}

std::uint16_t crc16(std::span<const std::uint8_t> bytes) noexcept {
  std::uint16_t crc = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    crc = static_cast<std::uint16_t>(crc ^ byte);
    for (int bit = 0; bit < 8; ++bit)
      crc = static_cast<std::uint16_t>((crc & 1U) != 0 ? (crc >> 1U) ^ 0xA001U : crc >> 1U);
  }
  return crc;
}

}  // namespace sinerig::modbus
