// What a frame to be sent looks like, and which received frames are meant.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "drivers/can/frame.h"
#include "drivers/can/signal.h"

namespace sinerig::can {

// A checksum byte over bytes first…last of the payload (the byte itself left out).
struct Checksum {
  enum class Kind : std::uint8_t { none, sum8, xor8, crc8 };

  Kind kind = Kind::none;
  std::uint8_t position = 0;
  std::uint8_t first = 0;
  std::uint8_t last = 0;
  bool with_id = false;            // the low byte of the identifier comes first
  std::uint8_t polynomial = 0x07;  // crc8 only, most significant bit first
  std::uint8_t initial = 0;
};

std::uint8_t checksum_of(const Frame& frame, const Checksum& checksum) noexcept;
void seal(Frame& frame, const Checksum& checksum) noexcept;
bool is_sealed(const Frame& frame, const Checksum& checksum) noexcept;

// Throws std::invalid_argument with the rule that the checksum breaks in a payload of that size.
void check(const Checksum& checksum, std::size_t payload_bytes);

// Frames that have the identifier (under the mask) and the payload bits (under theirs), and are at
// least `minimum_length` long.
struct Pattern {
  std::uint32_t id = 0;
  std::uint32_t id_mask = max_extended_id;
  bool extended = false;
  std::uint8_t minimum_length = 0;
  std::array<std::uint8_t, max_fd_bytes> value{};
  std::array<std::uint8_t, max_fd_bytes> mask{};

  bool matches(const Frame& frame) const noexcept;

  // From now on the payload must have `raw` in the bits of `signal`.
  void require(const Signal& signal, std::uint64_t raw) noexcept;
  // From now on the payload must have what that of `other` must; false where the two exclude each
  // other.
  bool join(const Pattern& other) noexcept;
  // From now on the payload must be long enough for `signal`.
  void cover(const Signal& signal) noexcept;

  void require_byte(std::size_t position, std::uint8_t byte,
                    std::uint8_t byte_mask = 0xFF) noexcept;
};

// "0x141", "0x00000921 (29 bit)".
std::string id_text(std::uint32_t id, bool extended);

// Throws std::invalid_argument when the frame cannot be on a bus: identifier, length, flags.
void check(const Frame& frame);

}  // namespace sinerig::can
