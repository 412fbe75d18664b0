// A CAN frame as the driver sees it: classic or FD, 11 or 29 bit, without the kernel's flag bits.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace sinerig::can {

inline constexpr std::size_t max_classic_bytes = 8;
inline constexpr std::size_t max_fd_bytes = 64;
inline constexpr std::uint32_t max_standard_id = 0x7FF;
inline constexpr std::uint32_t max_extended_id = 0x1FFFFFFF;

struct Frame {
  std::uint32_t id = 0;
  bool extended = false;         // 29-bit identifier
  bool fd = false;               // CAN-FD frame, up to 64 bytes
  bool bit_rate_switch = false;  // FD only: payload at the fast rate
  bool remote = false;           // classic only: a request without payload
  std::uint8_t length = 0;       // bytes of `data` that count
  std::array<std::uint8_t, max_fd_bytes> data{};

  std::span<const std::uint8_t> payload() const noexcept { return {data.data(), length}; }
  std::span<std::uint8_t> payload() noexcept { return {data.data(), length}; }

  friend bool operator==(const Frame&, const Frame&) = default;
};

// The payload sizes a frame of this kind can have on the wire: 0…8, and 12, 16, 20, 24, 32, 48, 64
// for FD.
constexpr bool is_frame_length(std::size_t length, bool fd) noexcept {
  if (length <= max_classic_bytes) return true;
  if (!fd || length > max_fd_bytes) return false;
  return length <= 24 ? length % 4 == 0 : length % 16 == 0;
}

}  // namespace sinerig::can
