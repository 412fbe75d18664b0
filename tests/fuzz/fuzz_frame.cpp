// Any frame can arrive: matching, checksums and every kind of signal stay inside its payload, and
// an encoded value reads back as what encode() said was applied.
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <stdexcept>

#include "drivers/can/frame_pattern.h"

namespace {

class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}

  template <class T>
  T next() {
    std::uint8_t raw[sizeof(T)] = {};
    for (std::uint8_t& byte : raw)
      if (position_ < size_) byte = data_[position_++];
    T value;
    std::memcpy(&value, raw, sizeof value);
    return value;
  }

 private:
  const std::uint8_t* data_;
  std::size_t size_;
  std::size_t position_ = 0;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace sinerig::can;
  Bytes bytes(data, size);
  Signal signal;
  signal.start_bit = bytes.next<std::uint16_t>() % 512;
  signal.length = bytes.next<std::uint8_t>();
  signal.order = bytes.next<std::uint8_t>() % 2 == 0 ? ByteOrder::intel : ByteOrder::motorola;
  signal.encoding = static_cast<Encoding>(bytes.next<std::uint8_t>() % 4);
  signal.scale = bytes.next<float>();
  signal.offset = bytes.next<float>();
  Checksum checksum{static_cast<Checksum::Kind>(bytes.next<std::uint8_t>() % 4),
                    bytes.next<std::uint8_t>(), bytes.next<std::uint8_t>(),
                    bytes.next<std::uint8_t>(), bytes.next<std::uint8_t>() % 2 == 0};
  const double value = bytes.next<double>();

  Frame frame;
  frame.length = bytes.next<std::uint8_t>() % (max_fd_bytes + 1);
  for (std::size_t n = 0; n < frame.length; ++n) frame.data[n] = bytes.next<std::uint8_t>();
  is_sealed(frame, checksum);
  seal(frame, checksum);
  if (checksum.kind != Checksum::Kind::none && checksum.position < frame.length &&
      !is_sealed(frame, checksum))
    std::abort();

  try {
    check(signal, frame.length);
  } catch (const std::invalid_argument&) {
    return 0;
  }
  sinerig::Unwrapper unwrapper(std::abs(value));
  unwrapper.apply(decode(frame.payload(), signal));
  const double applied = encode(frame.payload(), signal, value);
  const double read_back = decode(frame.payload(), signal);
  if (std::bit_cast<std::uint64_t>(applied) != std::bit_cast<std::uint64_t>(read_back))
    std::abort();

  Pattern pattern;
  pattern.require(signal, extract_raw(frame.payload(), signal));
  pattern.id = frame.id;
  if (!pattern.matches(frame)) std::abort();
  return 0;
}
