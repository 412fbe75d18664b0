#include "drivers/modbus/late_answers.h"

#include <algorithm>

namespace sinerig::modbus {
namespace {

constexpr std::uint8_t exception_bit = 0x80;
constexpr std::size_t refusal_size = 2;

}  // namespace

void LateAnswers::expect(const Request& request, std::int64_t until_ns) noexcept {
  Late& oldest = *std::ranges::min_element(late_, {}, &Late::until_ns);
  oldest = {.function = static_cast<std::uint8_t>(request.function),
            .size = reply_size(request),
            .until_ns = until_ns};
}

bool LateAnswers::could_be(const Request& request, std::int64_t now_ns) const noexcept {
  return request.reads() && std::ranges::any_of(late_, [&](const Late& late) {
           return late.until_ns > now_ns && late.size == reply_size(request) &&
                  late.function == static_cast<std::uint8_t>(request.function);
         });
}

bool LateAnswers::forget(std::span<const std::uint8_t> pdu) noexcept {
  for (Late& late : late_) {
    if (late.until_ns == 0) continue;
    const bool answer = late.size == pdu.size() && late.function == pdu[0];
    const bool refusal = pdu.size() == refusal_size && pdu[0] == (late.function | exception_bit);
    if (!answer && !refusal) continue;
    late = {};
    return true;
  }
  return false;
}

std::size_t LateAnswers::take_from(std::span<const std::uint8_t> bytes) noexcept {
  const auto whole = [&](std::size_t begin, std::size_t size) {
    const std::size_t end = begin + 1 + size;
    if (end + 2 > bytes.size()) return false;
    return crc16(bytes.subspan(begin, 1 + size)) == (bytes[end] | bytes[end + 1] << 8U);
  };
  for (std::size_t begin = 0; begin < bytes.size(); ++begin) {
    for (const Late& late : late_) {
      for (const std::size_t size : {late.size, refusal_size}) {
        if (late.until_ns == 0 || !whole(begin, size)) continue;
        if (forget(bytes.subspan(begin + 1, size))) return begin + 1 + size + 2;
      }
    }
  }
  return 0;
}

}  // namespace sinerig::modbus
