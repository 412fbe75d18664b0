// Answers on a serial line that may still come after their time-outs. Frames there have no number:
// a late one is told from the one that is waited for by its function and length alone.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "drivers/modbus/request.h"

namespace sinerig::modbus {

class LateAnswers {
 public:
  // The answer to `request` may come until then; the oldest expectation makes room.
  void expect(const Request& request, std::int64_t until_ns) noexcept;

  // Whether a late answer could be taken for the one to `request`, which reads.
  bool could_be(const Request& request, std::int64_t now_ns) const noexcept;

  // One has come, and is known by its function code and length; false: it is none of them.
  bool forget(std::span<const std::uint8_t> pdu) noexcept;

  // Forgets one that lies whole, with its check sum, in what came between two questions; where it
  // ends there, 0 if there is none. A byte of noise is none.
  std::size_t take_from(std::span<const std::uint8_t> bytes) noexcept;

  void clear() noexcept { late_.fill({}); }

 private:
  struct Late {
    std::uint8_t function = 0;
    std::size_t size = 0;
    std::int64_t until_ns = 0;
  };
  std::array<Late, 8> late_{};
};

}  // namespace sinerig::modbus
