#include "drivers/can/frame_pattern.h"

#include <algorithm>
#include <cstdio>
#include <stdexcept>

namespace sinerig::can {
namespace {

std::uint8_t crc8_step(std::uint8_t crc, std::uint8_t byte, std::uint8_t polynomial) noexcept {
  unsigned shifted = static_cast<unsigned>(crc ^ byte);
  for (int bit = 0; bit < 8; ++bit)
    shifted = (shifted & 0x80U) != 0U ? (shifted << 1U) ^ polynomial : shifted << 1U;
  return static_cast<std::uint8_t>(shifted);
}

std::uint8_t step(const Checksum& checksum, std::uint8_t so_far, std::uint8_t byte) noexcept {
  switch (checksum.kind) {
    case Checksum::Kind::none: return so_far;
    case Checksum::Kind::sum8: return static_cast<std::uint8_t>(so_far + byte);
    case Checksum::Kind::xor8: return static_cast<std::uint8_t>(so_far ^ byte);
    case Checksum::Kind::crc8: return crc8_step(so_far, byte, checksum.polynomial);
  }
  return so_far;
}

}  // namespace

std::uint8_t checksum_of(const Frame& frame, const Checksum& checksum) noexcept {
  std::uint8_t result = checksum.initial;
  if (checksum.with_id) result = step(checksum, result, static_cast<std::uint8_t>(frame.id));
  const std::size_t end = std::min<std::size_t>(checksum.last + 1U, frame.length);
  for (std::size_t n = checksum.first; n < end; ++n)
    if (n != checksum.position) result = step(checksum, result, frame.data[n]);
  return result;
}

void seal(Frame& frame, const Checksum& checksum) noexcept {
  if (checksum.kind != Checksum::Kind::none && checksum.position < frame.length)
    frame.data[checksum.position] = checksum_of(frame, checksum);
}

bool is_sealed(const Frame& frame, const Checksum& checksum) noexcept {
  if (checksum.kind == Checksum::Kind::none) return true;
  return checksum.position < frame.length &&
         frame.data[checksum.position] == checksum_of(frame, checksum);
}

void check(const Checksum& checksum, std::size_t payload_bytes) {
  if (checksum.kind == Checksum::Kind::none) return;
  const std::size_t highest = std::max(checksum.position, checksum.last);
  if (highest >= payload_bytes)
    throw std::invalid_argument("checksum: byte " + std::to_string(highest) +
                                " is outside a payload of " + std::to_string(payload_bytes) +
                                " bytes");
  if (checksum.first > checksum.last)
    throw std::invalid_argument("checksum: first byte " + std::to_string(checksum.first) +
                                " is after last byte " + std::to_string(checksum.last));
}

bool Pattern::matches(const Frame& frame) const noexcept {
  if (frame.remote || frame.extended != extended || frame.length < minimum_length) return false;
  if (((frame.id ^ id) & id_mask) != 0) return false;
  unsigned differing = 0;
  for (std::size_t n = 0; n < minimum_length; ++n)
    differing |= static_cast<unsigned>((frame.data[n] ^ value[n]) & mask[n]);
  return differing == 0;
}

void Pattern::require(const Signal& signal, std::uint64_t raw) noexcept {
  insert_raw(mask, signal, ~std::uint64_t{0});
  insert_raw(value, signal, raw);
  cover(signal);
}

bool Pattern::join(const Pattern& other) noexcept {
  unsigned contrary = 0;
  for (std::size_t n = 0; n < max_fd_bytes; ++n) {
    contrary |= static_cast<unsigned>((value[n] ^ other.value[n]) & mask[n] & other.mask[n]);
    value[n] = static_cast<std::uint8_t>((value[n] & mask[n]) | (other.value[n] & other.mask[n]));
    mask[n] = static_cast<std::uint8_t>(mask[n] | other.mask[n]);
  }
  minimum_length = std::max(minimum_length, other.minimum_length);
  return contrary == 0;
}

void Pattern::cover(const Signal& signal) noexcept {
  while (minimum_length < max_fd_bytes && !fits(signal, minimum_length)) ++minimum_length;
}

void Pattern::require_byte(std::size_t position, std::uint8_t byte,
                           std::uint8_t byte_mask) noexcept {
  value[position] = static_cast<std::uint8_t>((value[position] & ~byte_mask) | (byte & byte_mask));
  mask[position] = static_cast<std::uint8_t>(mask[position] | byte_mask);
  minimum_length = std::max(minimum_length, static_cast<std::uint8_t>(position + 1U));
}

std::string id_text(std::uint32_t id, bool extended) {
  char text[32];
  if (extended)
    std::snprintf(text, sizeof text, "0x%08X (29 bit)", id);
  else
    std::snprintf(text, sizeof text, "0x%03X", id);
  return text;
}

void check(const Frame& frame) {
  const std::uint32_t highest = frame.extended ? max_extended_id : max_standard_id;
  if (frame.id > highest)
    throw std::invalid_argument("identifier " + id_text(frame.id, frame.extended) + " is above " +
                                id_text(highest, frame.extended) +
                                (frame.extended ? "" : "; say that it is an extended one"));
  if (!is_frame_length(frame.length, frame.fd))
    throw std::invalid_argument("a payload of " + std::to_string(frame.length) +
                                " bytes does not exist in a " +
                                (frame.fd ? "CAN-FD frame: 0 to 8, 12, 16, 20, 24, 32, 48 or 64"
                                          : "classic frame: 0 to 8 (CAN-FD has up to 64)"));
  if (frame.bit_rate_switch && !frame.fd)
    throw std::invalid_argument("the fast bit rate exists in CAN-FD frames only");
  if (frame.remote && frame.fd)
    throw std::invalid_argument("remote requests exist in classic frames only");
}

}  // namespace sinerig::can
