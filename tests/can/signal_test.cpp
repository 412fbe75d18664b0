#include "drivers/can/signal.h"

#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "drivers/can/frame_pattern.h"

namespace sinerig::can {
namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr auto intel = ByteOrder::intel;
constexpr auto motorola = ByteOrder::motorola;

Signal make(unsigned start, unsigned length, ByteOrder order, Encoding encoding, double scale = 1.0,
            double offset = 0.0) {
  Signal signal;
  signal.start_bit = static_cast<std::uint16_t>(start);
  signal.length = static_cast<std::uint8_t>(length);
  signal.order = order;
  signal.encoding = encoding;
  signal.scale = scale;
  signal.offset = offset;
  return signal;
}

std::string refusal(const Signal& signal, std::size_t bytes) {
  try {
    check(signal, bytes);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(CanSignal, IntelFloatIsLittleEndian) {
  Bytes payload(8, 0xEE);
  const Signal torque = make(0, 32, intel, Encoding::float32);
  EXPECT_EQ(encode(payload, torque, 1.5), 1.5);
  EXPECT_EQ(payload, (Bytes{0x00, 0x00, 0xC0, 0x3F, 0xEE, 0xEE, 0xEE, 0xEE}));
  EXPECT_EQ(decode(payload, torque), 1.5);
}

TEST(CanSignal, MotorolaStartsAtItsMostSignificantBit) {
  Bytes payload(8, 0);
  insert_raw(payload, make(7, 16, motorola, Encoding::unsigned_integer), 0x1234);
  insert_raw(payload, make(23, 12, motorola, Encoding::unsigned_integer), 0xABC);
  insert_raw(payload, make(27, 12, motorola, Encoding::unsigned_integer), 0xDEF);
  EXPECT_EQ(payload, (Bytes{0x12, 0x34, 0xAB, 0xCD, 0xEF, 0x00, 0x00, 0x00}));
}

// The packed frame of the MIT mini-cheetah and its relatives: 16, 12, 12, 12, 12 bits, big-endian.
TEST(CanSignal, PacksTheMitFrame) {
  Bytes payload(8, 0xFF);
  const auto field = [](unsigned start, unsigned length, double limit) {
    return make(start, length, motorola, Encoding::unsigned_integer,
                2.0 * limit / (std::ldexp(1.0, static_cast<int>(length)) - 1.0), -limit);
  };
  encode(payload, field(7, 16, 12.5), 12.5);
  encode(payload, field(23, 12, 30.0), -30.0);
  insert_raw(payload, make(27, 12, motorola, Encoding::unsigned_integer), 0);
  insert_raw(payload, make(47, 12, motorola, Encoding::unsigned_integer), 0);
  const double applied = encode(payload, field(51, 12, 10.0), 5.0);
  EXPECT_EQ(payload, (Bytes{0xFF, 0xFF, 0x00, 0x00, 0x00, 0x00, 0x0B, 0xFF}));
  EXPECT_NEAR(applied, 5.0, 10.0 / 4095.0);
  EXPECT_EQ(applied, 0xBFF * (20.0 / 4095.0) - 10.0);
}

TEST(CanSignal, NegativeIntegersAreSignExtended) {
  Bytes payload(8, 0);
  const Signal current = make(32, 16, intel, Encoding::signed_integer, 0.01);
  EXPECT_NEAR(encode(payload, current, -1.23), -1.23, 1e-12);
  EXPECT_EQ(payload, (Bytes{0, 0, 0, 0, 0x85, 0xFF, 0, 0}));
  EXPECT_NEAR(decode(payload, current), -1.23, 1e-12);
}

TEST(CanSignal, NeighboursKeepTheirBits) {
  Bytes payload(2, 0xFF);
  insert_raw(payload, make(3, 7, intel, Encoding::unsigned_integer), 0);
  EXPECT_EQ(payload, (Bytes{0x07, 0xFC}));
}

TEST(CanSignal, CommandIsRoundedToTheNearestCodeNotTruncated) {
  Bytes payload(1, 0);
  const Signal coarse = make(0, 8, intel, Encoding::unsigned_integer, 0.5, -10.0);
  EXPECT_EQ(encode(payload, coarse, 0.24), 0.0);
  EXPECT_EQ(encode(payload, coarse, 0.26), 0.5);
}

TEST(CanSignal, CommandIsClampedToItsLimitsAndToWhatTheBitsHold) {
  Bytes payload(8, 0);
  Signal limited = make(0, 8, intel, Encoding::signed_integer);
  EXPECT_EQ(encode(payload, limited, 1000.0), 127.0);
  EXPECT_EQ(encode(payload, limited, -1000.0), -128.0);
  limited.minimum = -5.0;
  limited.maximum = 7.0;
  EXPECT_EQ(encode(payload, limited, 1000.0), 7.0);
  EXPECT_EQ(encode(payload, limited, -std::numeric_limits<double>::infinity()), -5.0);
  EXPECT_EQ(encode(payload, make(0, 64, intel, Encoding::unsigned_integer), 1e300),
            18446744073709551616.0);
  EXPECT_EQ(encode(payload, make(0, 64, intel, Encoding::signed_integer), -1e300),
            -9223372036854775808.0);
  EXPECT_EQ(encode(payload, make(0, 32, intel, Encoding::float32), 1e300),
            std::numeric_limits<float>::max());
}

TEST(CanSignal, NotANumberIsSentAsZero) {
  Bytes payload(8, 0xFF);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(encode(payload, make(0, 64, intel, Encoding::float64), nan), 0.0);
  EXPECT_EQ(encode(payload, make(0, 16, intel, Encoding::signed_integer, 0.1, 3.0), nan), 0.0);
}

TEST(CanSignal, RoundTripReturnsTheAppliedValueForRandomSignals) {
  std::mt19937_64 random(1);
  for (int trial = 0; trial < 20000; ++trial) {
    const auto length = static_cast<unsigned>(1 + random() % 64);
    const auto order = random() % 2 == 0 ? intel : motorola;
    const auto encoding = random() % 2 == 0 ? Encoding::signed_integer : Encoding::unsigned_integer;
    const Signal signal = make(static_cast<unsigned>(random() % 64), length, order, encoding,
                               std::ldexp(1.0, static_cast<int>(random() % 20) - 10), 4.0);
    if (!fits(signal, 8)) continue;
    Bytes payload(8);
    for (std::uint8_t& byte : payload) byte = static_cast<std::uint8_t>(random());
    const Bytes before = payload;
    const double value = std::ldexp(static_cast<double>(random() % 2000) - 1000.0,
                                    static_cast<int>(random() % 30) - 15);
    const double applied = encode(payload, signal, value);
    EXPECT_EQ(decode(payload, signal), applied) << describe(signal);
    const std::uint64_t raw_before = extract_raw(before, signal);
    insert_raw(payload, signal, raw_before);
    EXPECT_EQ(payload, before) << "bits outside were touched: " << describe(signal);
  }
}

TEST(CanSignal, RefusesWhatCannotBe) {
  EXPECT_THAT(
      refusal(make(60, 8, intel, Encoding::unsigned_integer), 8),
      testing::AllOf(testing::HasSubstr("60|8"), testing::HasSubstr("byte 8 of a payload of 8")));
  EXPECT_THAT(refusal(make(56, 16, motorola, Encoding::unsigned_integer), 8),
              testing::HasSubstr("most significant bit"));
  EXPECT_THAT(refusal(make(0, 31, intel, Encoding::float32), 8),
              testing::HasSubstr("32 bits long"));
  EXPECT_THAT(refusal(make(0, 32, intel, Encoding::float64), 8),
              testing::HasSubstr("64 bits long"));
  EXPECT_THAT(refusal(make(0, 0, intel, Encoding::unsigned_integer), 8),
              testing::HasSubstr("1 to 64 bits"));
  EXPECT_THAT(refusal(make(0, 8, intel, Encoding::unsigned_integer, 0.0), 8),
              testing::HasSubstr("scale"));
  Signal crossed = make(0, 8, intel, Encoding::unsigned_integer);
  crossed.minimum = 2.0;
  crossed.maximum = 1.0;
  EXPECT_THAT(refusal(crossed, 8), testing::HasSubstr("minimum"));
  EXPECT_EQ(refusal(make(7, 64, motorola, Encoding::float64), 8), "");
}

TEST(CanUnwrapper, FollowsAnAngleThroughManyTurnsBothWays) {
  Unwrapper unwrap(8192.0);
  double position = 4000.0;
  for (int step = 0; step < 4000; ++step) {
    position += step < 1500 ? 900.0 : -900.0;
    const double wrapped = position - std::floor(position / 8192.0) * 8192.0;
    ASSERT_EQ(unwrap.apply(wrapped), position) << "step " << step;
  }
}

TEST(CanUnwrapper, WithoutModulusLeavesTheValue) {
  Unwrapper none(0.0);
  EXPECT_EQ(none.apply(1e9), 1e9);
  EXPECT_EQ(none.apply(-1e9), -1e9);
}

Frame frame_of(std::uint32_t id, const Bytes& bytes) {
  Frame frame;
  frame.id = id;
  frame.length = static_cast<std::uint8_t>(bytes.size());
  std::copy(bytes.begin(), bytes.end(), frame.data.begin());
  return frame;
}

// MKS SERVO42 manual: the last byte is the low byte of identifier + data; F6 03 20 02 for axis 1.
TEST(CanChecksum, SumsIdentifierAndPayload) {
  Frame frame = frame_of(0x01, {0xF6, 0x03, 0x20, 0x02, 0x00});
  const Checksum sum{Checksum::Kind::sum8, 4, 0, 3, true};
  seal(frame, sum);
  EXPECT_EQ(frame.data[4], 0x1C);
  EXPECT_TRUE(is_sealed(frame, sum));
  frame.data[1] ^= 0x10;
  EXPECT_FALSE(is_sealed(frame, sum));
}

// CRC-8/SMBUS, check value of "123456789" is 0xF4.
TEST(CanChecksum, Crc8HasTheCatalogueCheckValue) {
  Frame frame = frame_of(0, {'1', '2', '3', '4', '5', '6', '7', '8', '9', 0, 0, 0});
  frame.fd = true;
  EXPECT_EQ(checksum_of(frame, {Checksum::Kind::crc8, 9, 0, 8}), 0xF4);
}

TEST(CanChecksum, AFrameTooShortForItIsNotSealed) {
  EXPECT_FALSE(is_sealed(frame_of(1, {1, 2}), {Checksum::Kind::xor8, 4, 0, 3}));
  EXPECT_THROW(check(Checksum{Checksum::Kind::xor8, 8, 0, 7}, 8), std::invalid_argument);
}

TEST(CanPattern, TellsRepliesOfOneIdentifierApart) {
  Pattern torque_reply;
  torque_reply.id = 0x241;
  torque_reply.require_byte(0, 0xA1);
  EXPECT_TRUE(torque_reply.matches(frame_of(0x241, {0xA1, 0, 0, 0})));
  EXPECT_FALSE(torque_reply.matches(frame_of(0x241, {0x9C, 0, 0, 0})));
  EXPECT_FALSE(torque_reply.matches(frame_of(0x242, {0xA1, 0, 0, 0})));
  EXPECT_FALSE(torque_reply.matches(frame_of(0x241, {}))) << "too short to tell";
  Frame extended = frame_of(0x241, {0xA1});
  extended.extended = true;
  EXPECT_FALSE(torque_reply.matches(extended));
}

TEST(CanPattern, RequiresTheBitsOfASignalOnly) {
  Pattern reply;
  reply.id_mask = 0;
  reply.require(make(0, 4, intel, Encoding::unsigned_integer), 5);
  EXPECT_TRUE(reply.matches(frame_of(0x000, {0xF5})));
  EXPECT_FALSE(reply.matches(frame_of(0x000, {0xF6})));
}

TEST(CanFrame, RefusesWhatCannotBeOnABus) {
  Frame frame = frame_of(0x800, {});
  EXPECT_THROW(check(frame), std::invalid_argument);
  frame.extended = true;
  EXPECT_NO_THROW(check(frame));
  frame.length = 9;
  EXPECT_THROW(check(frame), std::invalid_argument);
  frame.fd = true;
  EXPECT_THROW(check(frame), std::invalid_argument);
  frame.length = 12;
  EXPECT_NO_THROW(check(frame));
}

}  // namespace
}  // namespace sinerig::can
