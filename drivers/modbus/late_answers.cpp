#include "drivers/modbus/late_answers.h"

#include <algorithm>

namespace sinerig::modbus {

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

void LateAnswers::forget(std::span<const std::uint8_t> pdu) noexcept {
  for (Late& late : late_) {
    if (late.until_ns == 0 || late.size != pdu.size() || late.function != pdu[0]) continue;
    late = {};
    return;
  }
}

void LateAnswers::one_came(std::int64_t now_ns) noexcept {
  const auto due = [&](const Late& late) {
    return late.until_ns > now_ns;
  };
  if (std::ranges::count_if(late_, due) == 1) clear();
}

}  // namespace sinerig::modbus
