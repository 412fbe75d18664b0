#include "drivers/can/dbc.h"

#include <string>

#include <gmock/gmock.h>

namespace sinerig::can {
namespace {

using testing::HasSubstr;

constexpr const char* one_message =
    "VERSION \"\"\n"
    "BO_ 100 Drive: 8 Vector__XXX\n"
    " SG_ Position : 7|16@0- (0.001,0) [0|0] \"rad\" Host\n";

std::string refusal(const std::string& text) {
  try {
    Dbc::read_text(text, "test.dbc");
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

std::string refusal_of_find(const Dbc& dbc, const char* name) {
  try {
    dbc.find(name);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

TEST(Dbc, ReadsAMotorolaSignal) {
  const Dbc dbc = Dbc::read_text(one_message, "test.dbc");
  const DbcBinding position = dbc.find("Drive.Position");
  EXPECT_EQ(position.message->id, 100u);
  EXPECT_FALSE(position.message->extended);
  EXPECT_EQ(position.message->length, 8);
  EXPECT_EQ(position.signal->unit, "rad");
  EXPECT_EQ(position.signal->signal.start_bit, 7);
  EXPECT_EQ(position.signal->signal.order, ByteOrder::motorola);
  EXPECT_EQ(position.signal->signal.encoding, Encoding::signed_integer);
  EXPECT_EQ(position.signal->signal.scale, 0.001);
  EXPECT_TRUE(position.multiplexors.empty());
}

TEST(Dbc, FindsODriveSignalsOfTheFirstAxisWithoutThePrefix) {
  const Dbc dbc =
      Dbc::read_file(std::string(SINERIG_SOURCE_DIR) + "/config/devices/odrive-cansimple.dbc");
  EXPECT_EQ(dbc.messages().size(), 8u * 27u);
  const DbcBinding torque = dbc.find("Set_Input_Torque.Input_Torque");
  EXPECT_EQ(torque.message->name, "Axis0_Set_Input_Torque");
  EXPECT_EQ(torque.message->id, 14u);
  EXPECT_EQ(torque.signal->signal.encoding, Encoding::float32) << "by SIG_VALTYPE_";
  EXPECT_EQ(dbc.find("Axis3_Get_Encoder_Estimates.Vel_Estimate").message->id, 105u);
  EXPECT_EQ(dbc.find("Heartbeat.Axis_State").signal->signal.start_bit, 32);
}

TEST(Dbc, ExtendedIdentifiersHaveBit31) {
  const Dbc dbc = Dbc::read_text(
      "BO_ 2147486721 Status: 8 X\n SG_ Rpm : 7|32@0- (1,0) [0|0] \"\" X\n", "vesc.dbc");
  EXPECT_EQ(dbc.messages().at(0).id, 0xC01u);
  EXPECT_TRUE(dbc.messages().at(0).extended);
}

TEST(Dbc, MultiplexedSignalsNameWhatSelectsThem) {
  const Dbc dbc = Dbc::read_text(
      "BO_ 577 Reply: 8 X\n"
      " SG_ Command M : 0|8@1+ (1,0) [0|0] \"\" X\n"
      " SG_ Current m161 : 16|16@1- (0.01,0) [0|0] \"A\" X\n"
      " SG_ Sub m156M : 8|8@1+ (1,0) [0|0] \"\" X\n"
      " SG_ Deep m2 : 16|16@1- (1,0) [0|0] \"\" X\n"
      "SG_MUL_VAL_ 577 Deep Sub 2-2;\n",
      "rmd.dbc");
  const DbcBinding current = dbc.find("Reply.Current");
  ASSERT_EQ(current.multiplexors.size(), 1u);
  EXPECT_EQ(current.multiplexors[0].first->name, "Command");
  EXPECT_EQ(current.multiplexors[0].second, 161u);
  const DbcBinding deep = dbc.find("Reply.Deep");
  ASSERT_EQ(deep.multiplexors.size(), 2u);
  EXPECT_EQ(deep.multiplexors[0].first->name, "Sub");
  EXPECT_EQ(deep.multiplexors[1].first->name, "Command");
  EXPECT_EQ(deep.multiplexors[1].second, 156u);
}

TEST(Dbc, CommentsThatLookLikeSignalsAreSkipped) {
  const Dbc dbc = Dbc::read_text(std::string(one_message) +
                                     "CM_ SG_ 100 Position \"first line;\n"
                                     "BO_ 1 Trap: 8 X\n"
                                     " SG_ Trap : 0|8@1+ (1,0) [0|0] \\\"\\\" X\n"
                                     "last line\";\n"
                                     "VAL_ 100 Position 0 \"a;b\" 1 \"c\" ;\n",
                                 "test.dbc");
  EXPECT_EQ(dbc.messages().size(), 1u);
}

TEST(Dbc, OrphanSignalsAreSkipped) {
  const Dbc dbc = Dbc::read_text(
      "BO_ 3221225472 VECTOR__INDEPENDENT_SIG_MSG: 0 Vector__XXX\n"
      " SG_ Lost : 0|8@1+ (1,0) [0|0] \"\" Vector__XXX\n"
      "SIG_VALTYPE_ 3221225472 Lost : 1;\n",
      "test.dbc");
  EXPECT_TRUE(dbc.messages().empty());
}

TEST(Dbc, LimitsOfASignalClampItsCommands) {
  const Dbc dbc = Dbc::read_text(
      "BO_ 1 M: 8 X\n SG_ Torque : 0|32@1- (0.01,0) [-10|10] \"\" X\nSIG_VALTYPE_ 1 Torque : 1;\n",
      "test.dbc");
  EXPECT_EQ(dbc.find("M.Torque").signal->signal.minimum, -10.0);
  EXPECT_EQ(dbc.find("M.Torque").signal->signal.maximum, 10.0);
}

TEST(Dbc, RefusalsNameFileLineAndRule) {
  EXPECT_THAT(refusal("BO_ 1 M: 8 X\n SG_ S : 60|8@1+ (1,0) [0|0] \"\" X\n"),
              HasSubstr("test.dbc:2: M.S: signal at bits 60|8 Intel"));
  EXPECT_THAT(refusal("\n\nBO 1 M: 8 X\n"), HasSubstr("test.dbc:3: unknown keyword 'BO'"));
  EXPECT_THAT(refusal("BO_ 4096 M: 8 X\n"),
              HasSubstr("test.dbc:1: BO_ M: identifier 4096 does not fit"));
  EXPECT_THAT(refusal("BO_ 1 M: 65 X\n"), HasSubstr("a payload of 65 bytes; CAN-FD has up to 64"));
  EXPECT_THAT(refusal("BO_ 1 M: 8 X\nBO_ 1 N: 8 X\n"),
              HasSubstr("test.dbc:2: BO_ N: identifier 0x001 was given to M on line 1"));
  EXPECT_THAT(refusal("SG_ S : 0|8@1+ (1,0) [0|0] \"\" X\n"), HasSubstr("belongs to no BO_"));
  EXPECT_THAT(refusal(std::string(one_message) + " SG_ Position : 0|8@1+ (1,0) [0|0] \"\" X\n"),
              HasSubstr("test.dbc:4: SG_ Position is in Drive already, on line 3"));
  EXPECT_THAT(refusal("BO_ 1 M: 8 X\n SG_ S : 0|8@2+ (1,0) [0|0] \"\" X\n"),
              HasSubstr("byte order @2; it is 0 (Motorola) or 1 (Intel)"));
  EXPECT_THAT(refusal("BO_ 1 M: 8 X\n SG_ S : 0|65@1+ (1,0) [0|0] \"\" X\n"),
              HasSubstr("0|65; a signal has 1 to 64 bits"));
  EXPECT_THAT(refusal("BO_ 1 M: 8 X\n SG_ S q3 : 0|8@1+ (1,0) [0|0] \"\" X\n"),
              HasSubstr("multiplexing mark 'q3'"));
  EXPECT_THAT(refusal("BO_ 1 M: 8 X\n SG_ S : 0|8@1+ (0,0) [0|0] \"\" X\n"),
              HasSubstr("scale must be finite and not 0"));
  EXPECT_THAT(refusal("BO_ 1 M: 8 X\n SG_ S : 0 8@1+ (1,0) [0|0] \"\" X\n"),
              HasSubstr("expected '|' between start bit and length, found '8@1+"));
  EXPECT_THAT(refusal(std::string(one_message) + "SIG_VALTYPE_ 100 Position : 1;\n"),
              HasSubstr("test.dbc:4: Drive.Position: signal at bits 7|16"));
  EXPECT_THAT(refusal(std::string(one_message) + "SIG_VALTYPE_ 100 Speed : 1;\n"),
              HasSubstr("Drive has no signal 'Speed'"));
  EXPECT_THAT(refusal(std::string(one_message) + "SIG_VALTYPE_ 7 Speed : 1;\n"),
              HasSubstr("there is no message 7"));
  EXPECT_THAT(refusal("\nCM_ \"never closed;\n\n"),
              HasSubstr("test.dbc:2: the quotes are never closed"));
  EXPECT_THAT(refusal("BO_ 99999999999 M: 8 X\n"), HasSubstr("out of range"));
  EXPECT_THAT(refusal("BO_ 1"), HasSubstr("expected a message name, found the end of the file"));
}

TEST(Dbc, NamesThatAreNotThereAreRefusedWithWhatIs) {
  const Dbc dbc = Dbc::read_text(one_message, "test.dbc");
  EXPECT_THAT(refusal_of_find(dbc, "Drive.Speed"),
              HasSubstr("test.dbc:2: Drive has no signal 'Speed'; it has Position"));
  EXPECT_THAT(refusal_of_find(dbc, "Motor.Speed"), HasSubstr("there is no message 'Motor'"));
  EXPECT_THAT(refusal_of_find(dbc, "Position"), HasSubstr("must be given as Message.Signal"));
}

TEST(Dbc, AShortNameOfDifferentMessagesIsRefused) {
  const Dbc dbc = Dbc::read_text(
      "BO_ 1 A_Status: 8 X\n SG_ S : 0|8@1+ (1,0) [0|0] \"\" X\n"
      "BO_ 2 B_Status: 8 X\n SG_ S : 8|8@1+ (1,0) [0|0] \"\" X\n",
      "test.dbc");
  EXPECT_THAT(refusal_of_find(dbc, "Status.S"), HasSubstr("may be A_Status or B_Status"));
}

TEST(Dbc, MultiplexingThatCannotBeBoundIsRefused) {
  const Dbc ranges = Dbc::read_text(
      "BO_ 1 M: 8 X\n SG_ Sel M : 0|8@1+ (1,0) [0|0] \"\" X\n SG_ S m0 : 8|8@1+ (1,0) [0|0] \"\" "
      "X\n"
      "SG_MUL_VAL_ 1 S Sel 0-3, 5-5;\n",
      "test.dbc");
  EXPECT_THAT(refusal_of_find(ranges, "M.S"), HasSubstr("several multiplexor values"));
  const Dbc missing =
      Dbc::read_text("BO_ 1 M: 8 X\n SG_ S m0 : 8|8@1+ (1,0) [0|0] \"\" X\n", "test.dbc");
  EXPECT_THAT(refusal_of_find(missing, "M.S"), HasSubstr("M has no multiplexor"));
  const Dbc circle = Dbc::read_text(
      "BO_ 1 M: 8 X\n SG_ A m0M : 0|8@1+ (1,0) [0|0] \"\" X\n SG_ B m1M : 8|8@1+ (1,0) [0|0] \"\" "
      "X\n",
      "test.dbc");
  EXPECT_THAT(refusal_of_find(circle, "M.A"), HasSubstr("in a circle"));
}

TEST(Dbc, AMissingFileIsNamed) {
  try {
    Dbc::read_file("/nowhere/drive.dbc");
    FAIL() << "a missing file was read";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("/nowhere/drive.dbc: the DBC file cannot be read"));
  }
}

}  // namespace
}  // namespace sinerig::can
