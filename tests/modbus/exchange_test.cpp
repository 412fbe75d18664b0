#include "drivers/modbus/exchange.h"

#include <vector>

#include <gmock/gmock.h>

namespace sinerig::modbus {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

Place at(std::uint16_t address, RegisterType type = RegisterType::float32, std::uint8_t unit = 1,
         Table table = Table::holding) {
  return {.unit = unit, .table = table, .address = address, .format = {.type = type}};
}

std::vector<std::uint8_t> bytes(const Request& request) {
  const RequestBytes encoded = bytes_of(request);
  return {encoded.data.begin(), encoded.data.begin() + encoded.size};
}

TEST(ModbusExchange, AsksOnceForWhatLiesSideBySide) {
  const auto plan = ExchangePlan::make({at(36), at(34), at(100)}, nullptr, Writing::automatic, 0);
  ASSERT_EQ(plan.questions.size(), 2U);
  EXPECT_EQ(plan.questions[0].read_address, 34);
  EXPECT_EQ(plan.questions[0].read_count, 4);
  EXPECT_EQ(plan.questions[1].read_address, 100);
  EXPECT_EQ(plan.fields[0].offset, 2U);
  EXPECT_EQ(plan.fields[1].offset, 0U);
  EXPECT_EQ(plan.fields[2].question, 1U);
}

TEST(ModbusExchange, ReadsThroughAGapOnlyWhereItMay) {
  const auto count = [](std::size_t read_through) {
    return ExchangePlan::make({at(32), at(38)}, nullptr, Writing::automatic, read_through)
        .questions.size();
  };
  EXPECT_EQ(count(3), 2U);
  EXPECT_EQ(count(4), 1U);
}

TEST(ModbusExchange, KeepsUnitsTablesAndTheLongestAnswerApart) {
  const auto plan = ExchangePlan::make({at(0), at(2, RegisterType::float32, 2),
                                        at(2, RegisterType::float32, 1, Table::input), at(124)},
                                       nullptr, Writing::automatic, 200);
  EXPECT_EQ(plan.questions.size(), 4U);
}

TEST(ModbusExchange, WritesFirstAndReadsInTheSameQuestion) {
  const Place command = at(16);
  const auto plan = ExchangePlan::make({at(10, RegisterType::uint16, 1, Table::input), at(34)},
                                       &command, Writing::automatic, 0);
  ASSERT_EQ(plan.questions.size(), 2U);
  EXPECT_EQ(plan.questions[0].function, Function::write_and_read);
  EXPECT_EQ(plan.questions[1].function, Function::read_input);
  EXPECT_EQ(plan.fields[0].question, 1U);
  EXPECT_EQ(plan.fields[1].question, 0U);
}

TEST(ModbusExchange, WritesByItselfWhereItMust) {
  const Place command = at(16, RegisterType::int16);
  const auto multiple = ExchangePlan::make({at(34)}, &command, Writing::multiple, 0);
  ASSERT_EQ(multiple.questions.size(), 2U);
  EXPECT_EQ(multiple.questions[0].function, Function::write_multiple);
  EXPECT_EQ(multiple.fields[0].question, 1U);
  const auto single = ExchangePlan::make({at(34)}, &command, Writing::single, 0);
  EXPECT_EQ(single.questions[0].function, Function::write_single);
  const auto nothing_to_read = ExchangePlan::make({}, &command, Writing::automatic, 0);
  EXPECT_EQ(nothing_to_read.questions[0].function, Function::write_multiple);
}

TEST(ModbusExchange, RefusesMoreNumbersThanItHasRoomFor) {
  const std::vector<Place> places(max_fields + 1, at(0));
  EXPECT_THROW(ExchangePlan::make(places, nullptr, Writing::automatic, 0), std::invalid_argument);
}

// The examples of the specification V1.1b3, sections 6.3, 6.6, 6.12 and 6.17.
TEST(ModbusRequest, IsTheBytesOfTheSpecification) {
  EXPECT_THAT(
      bytes(
          {.unit = 17, .function = Function::read_holding, .read_address = 0x6B, .read_count = 3}),
      ElementsAre(17, 3, 0, 0x6B, 0, 3));
  EXPECT_THAT(bytes({.unit = 17,
                     .function = Function::write_single,
                     .write_address = 1,
                     .write_count = 1,
                     .words = {3}}),
              ElementsAre(17, 6, 0, 1, 0, 3));
  EXPECT_THAT(bytes({.unit = 17,
                     .function = Function::write_multiple,
                     .write_address = 1,
                     .write_count = 2,
                     .words = {0x0A, 0x0102}}),
              ElementsAre(17, 16, 0, 1, 0, 2, 4, 0, 0x0A, 1, 2));
  EXPECT_THAT(bytes({.unit = 17,
                     .function = Function::write_and_read,
                     .read_address = 3,
                     .read_count = 6,
                     .write_address = 0x0E,
                     .write_count = 3,
                     .words = {0xFF, 0xFF, 0xFF}}),
              ElementsAre(17, 23, 0, 3, 0, 6, 0, 0x0E, 0, 3, 6, 0, 0xFF, 0, 0xFF, 0, 0xFF));
}

TEST(ModbusReply, IsTakenOnlyWhereItAnswersTheQuestion) {
  const Request question{.function = Function::read_holding, .read_address = 1, .read_count = 2};
  std::array<std::uint16_t, max_read_registers> registers{};
  const auto kind = [&](std::vector<std::uint8_t> pdu) {
    return read_reply(pdu, question, registers).kind;
  };
  EXPECT_EQ(kind({3, 4, 1, 2, 3, 4}), ReplyKind::matches);
  EXPECT_EQ(registers[0], 0x0102);
  EXPECT_EQ(registers[1], 0x0304);
  EXPECT_EQ(kind({3, 2, 9, 9}), ReplyKind::other) << "the answer to a shorter question";
  EXPECT_EQ(kind({4, 4, 9, 9, 9, 9}), ReplyKind::other);
  EXPECT_EQ(kind({3, 4, 9, 9}), ReplyKind::other);
  EXPECT_EQ(kind({}), ReplyKind::other);
  EXPECT_EQ(kind({0x83, 2}), ReplyKind::exception);
  EXPECT_EQ(kind({0x84, 2}), ReplyKind::other);
  EXPECT_EQ(registers[0], 0x0102) << "what is not taken leaves no trace";
  EXPECT_EQ(exception_text(2), "exception 2, illegal data address");
  EXPECT_EQ(exception_text(77), "exception 77");
}

// 01 03 00 6B 00 03: check sum 0x1774, low byte first.
TEST(ModbusCheckSum, IsThatOfAKnownFrame) {
  const std::vector<std::uint8_t> frame{1, 3, 0, 0x6B, 0, 3};
  EXPECT_EQ(crc16(frame), 0x1774);
}

}  // namespace
}  // namespace sinerig::modbus
