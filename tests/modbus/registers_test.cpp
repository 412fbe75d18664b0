#include "drivers/modbus/registers.h"

#include <array>
#include <cmath>
#include <limits>

#include <gmock/gmock.h>

namespace sinerig::modbus {
namespace {

using Words = std::array<std::uint16_t, max_words>;

// 123456.0f = 0x47F12000 and its four orders.
struct OrderCase {
  const char* name;
  Order words;
  Order bytes;
  std::uint16_t first;
  std::uint16_t second;
};

class FloatOrder : public testing::TestWithParam<OrderCase> {};

TEST_P(FloatOrder, PutsEveryByteWhereItsNameSays) {
  const OrderCase& order = GetParam();
  const Format format{.type = RegisterType::float32, .words = order.words, .bytes = order.bytes};
  Words registers{};
  EXPECT_EQ(encode(registers, format, 123456.0), 123456.0);
  EXPECT_EQ(registers[0], order.first);
  EXPECT_EQ(registers[1], order.second);
  EXPECT_EQ(decode(registers, format), 123456.0);
}

INSTANTIATE_TEST_SUITE_P(
    Each, FloatOrder,
    testing::Values(OrderCase{"abcd", Order::high_first, Order::high_first, 0x47F1, 0x2000},
                    OrderCase{"cdab", Order::low_first, Order::high_first, 0x2000, 0x47F1},
                    OrderCase{"badc", Order::high_first, Order::low_first, 0xF147, 0x0020},
                    OrderCase{"dcba", Order::low_first, Order::low_first, 0x0020, 0xF147}),
    [](const auto& instance) { return instance.param.name; });

TEST(Registers, RoundToTheNearestCodeAndSayWhatItMeans) {
  const Format format{.type = RegisterType::int16, .scale = 0.01, .offset = 1.0};
  Words registers{};
  EXPECT_DOUBLE_EQ(encode(registers, format, 1.254), 1.25);
  EXPECT_EQ(registers[0], 25);
  EXPECT_DOUBLE_EQ(encode(registers, format, 0.996), 1.0 - 0.0);
  EXPECT_DOUBLE_EQ(encode(registers, format, -2.0), -2.0);
  EXPECT_EQ(registers[0], static_cast<std::uint16_t>(-300));
  EXPECT_DOUBLE_EQ(decode(registers, format), -2.0);
}

TEST(Registers, StopAtTheEndOfTheirType) {
  Words registers{};
  const auto applied = [&](RegisterType type, double value) {
    return encode(registers, {.type = type}, value);
  };
  EXPECT_EQ(applied(RegisterType::int16, 1e6), 32767.0);
  EXPECT_EQ(applied(RegisterType::int16, -1e6), -32768.0);
  EXPECT_EQ(applied(RegisterType::uint16, -1.0), 0.0);
  EXPECT_EQ(applied(RegisterType::int32, -1e12), -2147483648.0);
  EXPECT_EQ(applied(RegisterType::uint32, 1e12), 4294967295.0);
  EXPECT_EQ(applied(RegisterType::float32, 1e300),
            static_cast<double>(std::numeric_limits<float>::max()));
  EXPECT_EQ(applied(RegisterType::float64, 1e300), 1e300);
}

TEST(Registers, AFloatThatIsNoNumberIsReadAsNone) {
  Words registers{0x7FC0, 0};
  EXPECT_TRUE(std::isnan(decode(registers, {.type = RegisterType::float32})));
}

}  // namespace
}  // namespace sinerig::modbus
