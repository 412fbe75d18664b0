// Any answer can arrive: reading it stays inside its bytes and takes nothing but what was asked
// for, and an encoded number reads back as what encode() said was applied.
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <span>

#include "drivers/modbus/registers.h"
#include "drivers/modbus/request.h"

namespace {

template <class T>
T take(std::span<const std::uint8_t>& bytes) {
  std::uint8_t raw[sizeof(T)] = {};
  const std::size_t count = std::min(bytes.size(), sizeof raw);
  if (count > 0) std::memcpy(raw, bytes.data(), count);
  bytes = bytes.subspan(count);
  T value;
  std::memcpy(&value, raw, sizeof value);
  return value;
}

void require(bool condition) {
  if (!condition) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sinerig::modbus;
  std::span<const std::uint8_t> bytes{data, size};

  Format format;
  format.type = static_cast<RegisterType>(take<std::uint8_t>(bytes) % 6);
  format.words = static_cast<Order>(take<std::uint8_t>(bytes) % 2);
  format.bytes = static_cast<Order>(take<std::uint8_t>(bytes) % 2);
  const auto scale = static_cast<double>(take<float>(bytes));
  format.scale = std::isfinite(scale) && scale != 0.0 ? scale : 1.0;
  const auto value = take<double>(bytes);
  std::array<std::uint16_t, max_words> registers =
      take<std::array<std::uint16_t, max_words>>(bytes);
  decode(registers, format);
  if (!std::isnan(value)) {
    const double applied = encode(registers, format, value);
    require(std::bit_cast<std::uint64_t>(applied) ==
            std::bit_cast<std::uint64_t>(decode(registers, format)));
  }

  constexpr Function functions[] = {Function::read_holding, Function::read_input,
                                    Function::write_single, Function::write_multiple,
                                    Function::write_and_read};
  Request request;
  request.function = functions[take<std::uint8_t>(bytes) % 5];
  request.read_count = static_cast<std::uint16_t>(1 + take<std::uint8_t>(bytes) % 125);
  request.write_count = static_cast<std::uint16_t>(1 + take<std::uint8_t>(bytes) % 4);
  request.write_address = take<std::uint16_t>(bytes);
  request.words = registers;
  require(bytes_of(request).size <= bytes_of(request).data.size());
  std::array<std::uint16_t, max_read_registers> read{};
  const Reply reply = read_reply(bytes, request, read);
  require(reply.kind != ReplyKind::matches || bytes.size() == reply_size(request));
  crc16(bytes);
  return 0;
}
