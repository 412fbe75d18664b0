#include "drivers/can/can_config.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>

#include "drivers/can/can_driver.h"
#include "tests/can/shipped_profile.h"

namespace sinerig::can {
namespace {

using config::ConfigError;
using config::RigFile;
using config::Section;
using testing::HasSubstr;
using Bytes = std::vector<std::uint8_t>;

Bytes bytes_of(const Frame& frame) {
  return {frame.data.begin(), frame.data.begin() + frame.length};
}

Bytes set_point(const CommandSettings& settings, double value) {
  Frame frame = settings.frame;
  encode(frame.payload(), settings.signal, value);
  seal(frame, settings.checksum);
  return bytes_of(frame);
}

double value_of(const FeedbackSettings& settings, const Bytes& bytes) {
  Frame frame;
  frame.id = settings.pattern.id;
  frame.extended = settings.pattern.extended;
  frame.length = static_cast<std::uint8_t>(bytes.size());
  std::copy(bytes.begin(), bytes.end(), frame.data.begin());
  EXPECT_TRUE(settings.pattern.matches(frame));
  return decode(frame.payload(), settings.signal);
}

// The example of documentation/comm_can.md: 51 A to VESC 23.
TEST(CanProfile, VescSetsCurrentAsItsDocumentationShows) {
  const Profile vesc("vesc.toml", 23);
  const CommandSettings current = vesc.command("current");
  EXPECT_EQ(current.frame.id, 0x117u);
  EXPECT_TRUE(current.frame.extended);
  EXPECT_EQ(set_point(current, 51.0), (Bytes{0x00, 0x00, 0xC7, 0x38}));
  EXPECT_EQ(vesc.feedback("erpm").pattern.id, 0x917u);
}

TEST(CanProfile, ODriveTorqueIsAFloatOfTheNodesMessage) {
  const Profile odrive("odrive.toml", 3);
  const CommandSettings torque = odrive.command("torque");
  EXPECT_EQ(torque.frame.id, 3u * 32u + 14u);
  EXPECT_EQ(set_point(torque, -1.5), (Bytes{0, 0, 0xC0, 0xBF, 0, 0, 0, 0}));
  ASSERT_EQ(torque.startup.size(), 1u);
  EXPECT_EQ(torque.startup[0].frame->id, 3u * 32u + 24u);
  EXPECT_EQ(torque.startup[0].frame->length, 0);
  ASSERT_EQ(torque.arm.size(), 2u);
  EXPECT_EQ(bytes_of(*torque.arm[0].frame), (Bytes{1, 0, 0, 0, 1, 0, 0, 0}));
  EXPECT_EQ(bytes_of(*torque.arm[1].frame), (Bytes{8, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(torque.arm[1].expect->pattern.id, 3u * 32u + 1u);
  EXPECT_EQ(odrive.command("velocity").arm.at(0).frame->data[0], 2);
  EXPECT_EQ(odrive.command("position").arm.at(0).frame->data[0], 3);
  EXPECT_EQ(torque.health.size(), 2u);
  // A quarter turn.
  EXPECT_DOUBLE_EQ(value_of(odrive.feedback("position"), {0, 0, 0x80, 0x3E, 0, 0, 0, 0}),
                   1.5707963267948966);
}

TEST(CanProfile, MitFramesHoldNeutralConstantsAndTheNodesReply) {
  const Profile mit("mit-dm4310.toml", 5);
  const CommandSettings torque = mit.command("torque");
  EXPECT_EQ(torque.frame.id, 5u);
  EXPECT_EQ(set_point(torque, 10.0), (Bytes{0x80, 0x00, 0x80, 0x00, 0x00, 0x00, 0x0F, 0xFF}));
  EXPECT_EQ(torque.arm.at(0).frame->id, 5u);
  EXPECT_EQ(torque.arm.at(0).expect->pattern.id, 0u) << "answered to MST_ID";
  EXPECT_NEAR(value_of(mit.feedback("position"), {0x15, 0xFF, 0xFF, 0, 0, 0, 0, 0}), 12.5, 1e-12);
}

// The torque of the example in docs/protocol/can.md is an int16; here the registers are floats.
TEST(CanProfile, MoteusFramesAreWholeFdFrames) {
  const Profile moteus("moteus.toml", 1);
  const CommandSettings torque = moteus.command("torque");
  EXPECT_EQ(torque.frame.id, 0x8001u);
  EXPECT_TRUE(torque.frame.fd && torque.frame.bit_rate_switch);
  const Bytes frame = set_point(torque, 1.0);
  ASSERT_EQ(frame.size(), 32u);
  EXPECT_EQ(Bytes(frame.begin(), frame.begin() + 9),
            (Bytes{0x01, 0x00, 0x0A, 0x0F, 0x22, 0x00, 0x00, 0x80, 0x3F}));
  EXPECT_EQ(moteus.feedback("velocity").pattern.id, 0x100u);
  EXPECT_TRUE(moteus.feedback("velocity").fd);
}

TEST(CanProfile, RmdTorqueReplyIsToldApartByItsCommandByte) {
  const Profile rmd("myactuator-rmd.toml", 1);
  EXPECT_EQ(rmd.command("current").frame.id, 0x141u);
  EXPECT_EQ(set_point(rmd.command("current"), -1.0), (Bytes{0xA1, 0, 0, 0, 0x9C, 0xFF, 0, 0}));
  const FeedbackSettings angle = rmd.feedback("angle");
  EXPECT_EQ(angle.pattern.id, 0x241u);
  ASSERT_EQ(angle.polls.size(), 1u);
  EXPECT_EQ(bytes_of(angle.polls[0]), (Bytes{0x92, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_NEAR(value_of(angle, {0x92, 0, 0, 0, 0xA0, 0x8C, 0, 0}), 6.283185307179586, 1e-12);
}

TEST(CanProfile, RmdAnswersSpeedAsItAnswersCurrent) {
  const Profile rmd("myactuator-rmd.toml", 1);
  const FeedbackSettings velocity = rmd.feedback("velocity");
  const FeedbackSettings current = rmd.feedback("current");
  for (const std::uint8_t command :
       {rmd.command("current").frame.data[0], rmd.command("velocity").frame.data[0]}) {
    const Bytes answer{command, 0x1E, 0x64, 0x00, 0xB4, 0x00, 0x2D, 0x00};
    EXPECT_NEAR(value_of(velocity, answer), 3.141592653589793, 1e-12);
    EXPECT_NEAR(value_of(current, answer), 1.0, 1e-12);
  }
  Frame other;
  other.id = velocity.pattern.id;
  other.length = 8;
  for (const std::uint8_t first : Bytes{0x92, 0x9A, 0x9C, 0xA4, 0x81}) {
    other.data[0] = first;
    EXPECT_FALSE(velocity.pattern.matches(other)) << int{first};
  }
}

TEST(CanProfile, RmdIsAskedForItsErrors) {
  for (const char* name : {"current", "velocity"}) {
    const CommandSettings command = Profile("myactuator-rmd.toml", 1).command(name);
    ASSERT_EQ(command.keep_alive.size(), 1u);
    EXPECT_EQ(bytes_of(command.keep_alive[0].frame), (Bytes{0x9A, 0, 0, 0, 0, 0, 0, 0}));
    EXPECT_EQ(command.keep_alive[0].frame.id, 0x141u);
    EXPECT_EQ(command.keep_alive[0].period_ns, 100'000'000);
    ASSERT_EQ(command.health.size(), 1u);
    const HealthRule& rule = command.health[0];
    EXPECT_EQ(rule.value, 0.0);
    EXPECT_GT(rule.max_age_ns, command.keep_alive[0].period_ns);
    Frame status;
    status.id = 0x241;
    status.length = 8;
    status.data = {0x9A, 0x32, 0, 1, 0xE5, 0x01, 0x04, 0x10};  // 48.5 V; low voltage, too hot
    EXPECT_TRUE(rule.pattern.matches(status));
    EXPECT_EQ(decode(status.payload(), rule.signal), 0x1004);
    status.data[0] = 0xA1;
    EXPECT_FALSE(rule.pattern.matches(status));
  }
}

TEST(CanProfile, Gm6020IsBigEndianAndWraps) {
  const Profile gm("dji-gm6020.toml", 2);
  const CommandSettings current = gm.command("current");
  EXPECT_EQ(current.frame.id, 0x1FEu);
  EXPECT_EQ(set_point(current, 1.5), (Bytes{0, 0, 0x20, 0, 0, 0, 0, 0}));
  const FeedbackSettings angle = gm.feedback("angle");
  EXPECT_EQ(angle.pattern.id, 0x206u);
  EXPECT_NEAR(value_of(angle, {0x10, 0, 0, 0, 0, 0, 0, 0}), 3.141592653589793, 1e-12);
  EXPECT_NEAR(angle.signal.wrap_modulus, 6.283185307179586, 1e-12);
}

TEST(CanProfile, EveryGm6020HasItsWord) {
  for (std::uint32_t node = 1; node <= 7; ++node) {
    const Profile gm("dji-gm6020.toml", node);
    Bytes words(8, 0);
    words[(node - 1) % 4 * 2] = 0x20;
    EXPECT_EQ(set_point(gm.command("current"), 1.5), words) << node;
    EXPECT_EQ(gm.command("current").frame.id, node <= 4 ? 0x1FEu : 0x2FEu) << node;
    EXPECT_EQ(gm.command("voltage").frame.id, node <= 4 ? 0x1FFu : 0x2FFu) << node;
  }
  const CommandSettings counted =
      Laid("dji-gm6020.toml", "command", "current", "id = 0x2FE\nstart_bit = 23\n", 6).command();
  EXPECT_EQ(counted.frame.id, 0x2FEu);
  EXPECT_EQ(set_point(counted, 1.5), (Bytes{0, 0, 0x20, 0, 0, 0, 0, 0}));
}

TEST(CanProfile, MitDrivesOfOneAnswerIdentifierAreToldApart) {
  for (const std::string name : {"mit-dm4310.toml", "mit-mini-cheetah.toml"}) {
    const Profile mit(name, 1);
    const CommandSettings torque = mit.command("torque");
    Frame reply;
    reply.length = 8;
    for (const unsigned node : {1U, 2U}) {
      reply.data[0] = static_cast<std::uint8_t>(name == "mit-dm4310.toml" ? 0x10 | node : node);
      EXPECT_EQ(torque.arm.at(0).expect->pattern.matches(reply), node == 1) << name;
      EXPECT_EQ(mit.feedback("position").pattern.matches(reply), node == 1) << name;
      for (const HealthRule& rule : torque.health)
        EXPECT_EQ(rule.pattern.matches(reply), node == 1) << name;
    }
  }
  EXPECT_TRUE(Profile("mit-dm4310.toml", 0x21).feedback("position").pattern.matches([] {
    Frame reply;
    reply.length = 8;
    reply.data[0] = 0x11;
    return reply;
  }()))
      << "of a longer node the low half";
}

TEST(CanProfile, AMitDriveMayAnswerToAnyIdentifier) {
  const std::string there = "answer_id = 0x11\n";
  const CommandSettings torque = Laid("mit-dm4310.toml", "command", "torque", there, 5).command();
  EXPECT_EQ(torque.frame.id, 5u);
  EXPECT_EQ(torque.arm.at(0).frame->id, 5u);
  EXPECT_EQ(torque.arm.at(0).expect->pattern.id, 0x11u);
  EXPECT_EQ(torque.health.at(0).pattern.id, 0x11u);
  const auto position = [](const std::string& keys) {
    return Laid("mit-dm4310.toml", "feedback", "position", keys, 5).feedback().pattern.id;
  };
  EXPECT_EQ(position(there), 0x11u);
  EXPECT_EQ(position("id = 0x12\n"), 0x12u);
  EXPECT_EQ(Laid("mit-mini-cheetah.toml", "command", "torque", there, 5)
                .command()
                .arm.at(0)
                .expect->pattern.id,
            0x11u);
}

TEST(CanProfile, Cia402StartsByExpeditedSdoAndSyncsEveryTick) {
  const Profile drive("cia402.toml", 4);
  const CommandSettings torque = drive.command("torque");
  EXPECT_EQ(torque.frame.id, 0x204u);
  EXPECT_EQ(set_point(torque, 0.5), (Bytes{0x0F, 0x00, 0xF4, 0x01}));
  const Step& mode = torque.startup.back();
  EXPECT_EQ(mode.frame->id, 0x604u);
  EXPECT_EQ(mode.expect->pattern.id, 0x584u);
  EXPECT_TRUE(mode.expect->refusal.has_value());
  EXPECT_EQ(torque.startup.front().frame->id, 0u) << "NMT has no node in its identifier";
  ASSERT_EQ(torque.keep_alive.size(), 1u);
  EXPECT_EQ(torque.keep_alive[0].frame.id, 0x080u);
  EXPECT_EQ(torque.keep_alive[0].period_ns, 0);
}

// Before a SYNC, and before the NMT start, it would not be taken.
TEST(CanProfile, Cia402GetsItsNeutralSetPointRightBeforeOperationIsEnabled) {
  const CommandSettings torque = Profile("cia402.toml", 4).command("torque");
  std::vector<std::string> names;
  for (const Step& step : torque.arm)
    if (step.neutral || step.name.starts_with("NMT") || step.name.ends_with("enable operation"))
      names.push_back(step.neutral ? "neutral" : step.name);
  EXPECT_THAT(names,
              testing::ElementsAre("NMT operational", "neutral", "controlword enable operation"));
}

TEST(CanProfile, Cia402IsWellOnlyInOperation) {
  const CommandSettings torque = Profile("cia402.toml", 4).command("torque");
  const auto is_well = [&](std::uint8_t statusword) {
    const Bytes report{statusword, 0x02};
    return std::ranges::all_of(torque.health, [&](const HealthRule& rule) {
      return decode(report, rule.signal) == rule.value;
    });
  };
  EXPECT_TRUE(is_well(0x37));
  EXPECT_TRUE(is_well(0x27));
  EXPECT_FALSE(is_well(0x07)) << "quick stop active";
  EXPECT_FALSE(is_well(0x2F)) << "fault reaction active";
  EXPECT_FALSE(is_well(0x33)) << "switched on";
}

// A drive's first answers say that it is stopped: health must not see them.
TEST(CanProfile, MoteusIsArmedOnceItReportsPositionMode) {
  for (const std::uint32_t node : {1U, 7U, 8U, 100U}) {
    const Profile moteus("moteus.toml", node);
    const CommandSettings torque = moteus.command("torque");
    const bool extended = node >= 8;
    ASSERT_EQ(torque.arm.size(), 1u);
    EXPECT_TRUE(torque.arm[0].neutral);
    Frame answer;
    answer.id = node * 0x100;
    answer.extended = extended;
    answer.fd = true;
    answer.length = 20;
    EXPECT_FALSE(torque.arm[0].expect->pattern.matches(answer));
    answer.data[16] = 10;
    EXPECT_TRUE(torque.arm[0].expect->pattern.matches(answer));
    EXPECT_EQ(torque.health.at(0).pattern.extended, extended);
    EXPECT_EQ(moteus.feedback("position").pattern.extended, extended);
    EXPECT_EQ(moteus.feedback("position").pattern.id, node * 0x100);
    EXPECT_TRUE(torque.frame.extended && torque.startup.at(0).frame->extended);
  }
}

TEST(CanProfile, MiniCheetahIsBelievedWithoutAState) {
  const Profile mini("mit-mini-cheetah.toml", 5);
  const CommandSettings torque = mini.command("torque");
  EXPECT_EQ(set_point(torque, 18.0), (Bytes{0x80, 0x00, 0x80, 0x00, 0x00, 0x00, 0x0F, 0xFF}));
  EXPECT_TRUE(torque.health.empty());
  Frame reply;
  reply.length = 6;
  reply.data = {5, 0xFF, 0xFF};
  EXPECT_TRUE(torque.arm.at(0).expect->pattern.matches(reply)) << "the id in the first byte";
  EXPECT_NEAR(value_of(mini.feedback("position"), {5, 0xFF, 0xFF, 0, 0, 0}), 12.5, 1e-12);
  EXPECT_NEAR(value_of(mini.feedback("torque"), {5, 0, 0, 0, 0x0F, 0xFF}), 18.0, 1e-12);
}

TEST(CanProfile, TellWhatComesOnlyAsAnAnswer) {
  EXPECT_TRUE(Profile("moteus.toml", 1).feedback("torque").answers_command);
  EXPECT_TRUE(Profile("mit-dm4310.toml", 1).feedback("position").answers_command);
  for (const char* name : {"position", "velocity", "torque"})
    EXPECT_TRUE(Profile("cia402.toml", 1).feedback(name).answers_command) << "to a SYNC";
  EXPECT_TRUE(Profile("myactuator-rmd.toml", 1).feedback("velocity").answers_command);
  EXPECT_FALSE(Profile("myactuator-rmd.toml", 1).feedback("angle").answers_command) << "asked for";
  EXPECT_FALSE(Profile("odrive.toml", 1).feedback("position").answers_command);
}

TEST(CanProfile, ListsOfTheRigFollowThoseOfTheProfile) {
  const Profile odrive("odrive.toml", 3);
  const auto rig = RigFile::parse(
      "[actuator]\nstartup = [{ name = \"limits\", id = 0x00F, length = 8 }]\n"
      "keep_alive = [{ name = \"alive\", id = 0x700, period_s = 0.1 }]\n"
      "health = [{ name = \"temperature\", id = 0x015, length = 8, start_bit = 0, at_most = 80 "
      "}]\n",
      "rig.toml");
  const Keys profile = odrive.part("command", "torque");
  const Keys keys{rig->section("actuator"), ".", profile.at("unit"), devices};
  const CommandSettings torque = odrive.reader().command(keys, 0.0);
  std::vector<std::string> names;
  for (const Step& step : torque.startup) names.push_back(step.name);
  EXPECT_THAT(names, testing::ElementsAre("clear errors", "limits"));
  EXPECT_EQ(torque.keep_alive.size(), 1u);
  EXPECT_EQ(torque.health.size(), 3u);
}

// 1 turn/s of the drive is 2π rad/s of the profile, and twice that of the rig.
TEST(CanProfile, TheRigsUnitScaleIsAddedToThatOfTheProfile) {
  const Laid velocity("odrive.toml", "command", "velocity", "unit_scale = 2\n");
  EXPECT_EQ(set_point(velocity.command(), 12.566370614359172),
            (Bytes{0, 0, 0x80, 0x3F, 0, 0, 0, 0}));
  EXPECT_EQ(set_point(Laid("odrive.toml", "command", "velocity", "unit_scale = 1\n").command(),
                      6.283185307179586),
            (Bytes{0, 0, 0x80, 0x3F, 0, 0, 0, 0}));
  const Laid turned("odrive.toml", "feedback", "position", "unit_scale = -1\n");
  EXPECT_DOUBLE_EQ(value_of(turned.feedback(), {0, 0, 0x80, 0x3E, 0, 0, 0, 0}),
                   -1.5707963267948966);
}

TEST(CanProfile, AnotherUnitThanThatOfTheProfileNeedsItsFactor) {
  EXPECT_THAT([] { Laid("odrive.toml", "feedback", "position", "unit = \"deg\"\n").feedback(); },
              testing::ThrowsMessage<ConfigError>(
                  HasSubstr("rig.toml:2: [c] unit = 'deg': the profile's is \"rad\"; give "
                            "unit_scale: how many of this unit are one of the profile's")));
  EXPECT_NO_THROW(Laid("odrive.toml", "feedback", "position", "unit = \"deg\"\nunit_scale = 57.3\n")
                      .feedback());
  EXPECT_NO_THROW(Laid("odrive.toml", "feedback", "position", "unit = \"rad\"\n").feedback());
}

TEST(CanProfile, ClampAndWrapOfTheProfileFollowTheRigsUnit) {
  const auto most = [](const CommandSettings& settings) {
    Frame frame = settings.frame;
    return encode(frame.payload(), settings.signal, 1e9);
  };
  const auto rmd = [](const std::string& keys) {
    return Laid("myactuator-rmd.toml", "command", "current", keys).command();
  };
  EXPECT_NEAR(most(rmd("unit_scale = 0.1\n")), 2.0, 1e-9) << "20 A, in Nm";
  EXPECT_NEAR(most(rmd("unit_scale = -0.1\nclamp_min = -1\n")), 2.0, 1e-9);
  EXPECT_NEAR(most(rmd("unit_scale = 0.1\nclamp_max = 1.5\n")), 1.5, 1e-9) << "the rig's unit";
  const CommandSettings gm =
      Laid("dji-gm6020.toml", "command", "current", "unit_scale = 0.741\n").command();
  EXPECT_NEAR(most(gm), 3.0 * 0.741, 1e-9);
  EXPECT_EQ(set_point(gm, 1e9), (Bytes{0x40, 0, 0, 0, 0, 0, 0, 0})) << "full scale, 16384";
  const FeedbackSettings degrees =
      Laid("dji-gm6020.toml", "feedback", "angle", "unit_scale = -57.29577951308232\n").feedback();
  EXPECT_NEAR(degrees.signal.wrap_modulus, 360.0, 1e-9);
}

TEST(CanProfile, EveryShippedProfileIsReadWholeByTheDriver) {
  int profiles = 0;
  for (const auto& entry : std::filesystem::directory_iterator(devices)) {
    if (entry.path().extension() != ".toml") continue;
    const auto profile = RigFile::load(entry.path().string());
    const std::string command = profile->children("command").front().name().substr(8);
    const std::string feedback = profile->children("feedback").front().name().substr(9);
    const std::string channel = "driver = \"can\"\ninterface = \"can0\"\nnode = 1\nprofile = \"" +
                                entry.path().filename().string() + "\"\n";
    auto file = RigFile::parse(
        "[loop]\nrate_hz = 1000\n[sweep]\nstart_hz = 1\nstop_hz = 10\n"
        "points = 3\namplitude = 0.1\n[limits]\n[actuator]\n" +
            channel + "command = \"" + command + "\"\n[sensor.s]\n" + channel + "feedback = \"" +
            feedback + "\"\n",
        devices + "/rig.toml");
    const config::Rig rig = config::read_rig(std::move(file));
    EXPECT_NO_THROW(can_driver().configure({rig, &rig.actuator, {&rig.sensors.front()}}));
    EXPECT_NO_THROW(rig.file->refuse_unread()) << entry.path();
    ++profiles;
  }
  EXPECT_EQ(profiles, 8);
}

// A device on a rig file in TempDir with this loop and these keys of [actuator] and [sensor.s];
// profiles are found in the shipped folder.
std::vector<std::string> remarks_of(double rate_hz, const std::string& actuator,
                                    const std::string& sensor, std::string* doubt = nullptr) {
  const std::string common = "driver = \"can\"\ninterface = \"can0\"\n";
  const config::Rig rig = config::read_rig(RigFile::parse(
      "[loop]\nrate_hz = " + std::to_string(rate_hz) +
          "\n[sweep]\nstart_hz = 1\nstop_hz = 10\npoints = 3\namplitude = 0.1\n[limits]\n"
          "[actuator]\n" +
          common + actuator + "[sensor.s]\n" + common + sensor,
      devices + "/rig.toml"));
  const auto device = can_driver().configure({rig, &rig.actuator, {&rig.sensors.front()}});
  rig.file->refuse_unread();
  std::vector<std::string> texts;
  for (const Remark& remark : device->remarks()) {
    if (remark.doubts && doubt != nullptr) *doubt = remark.text;
    texts.push_back(remark.text);
  }
  return texts;
}

const std::string some_sensor = "id = 9\nlength = 8\nstart_bit = 0\n";

TEST(CanConfig, TellsWhatTheBitsOfEveryChannelWereTakenFor) {
  EXPECT_THAT(
      remarks_of(1000.0, "profile = \"odrive.toml\"\ncommand = \"torque\"\nnode = 3\n",
                 "id = 0x8009\nextended = true\nlength = 8\nstart_bit = 7\norder = \"motorola\"\n"
                 "type = \"int\"\nbits = 32\n"),
      testing::ElementsAre("command: Axis0_Set_Input_Torque.Input_Torque, frame 0x06E, bits 0|32 "
                           "Intel, float32, scale 1, offset 0",
                           "s: frame 0x00008009 (29 bit), bits 7|32 Motorola, signed, scale 1, "
                           "offset 0"));
}

TEST(CanConfig, DoubtsAFloatThatItsDbcFileCallsAnInteger) {
  const std::string path = testing::TempDir() + "/doubtful.dbc";
  const auto doubt_of = [&](const std::string& signal, const std::string& more = "") {
    std::ofstream{path} << "VERSION \"\"\n\nBO_ 256 Report: 8 Drive\n SG_ Position : " << signal
                        << " [0|0] \"rad\" Vector__XXX\n\n"
                        << more;
    std::string doubt;
    remarks_of(1000.0, "id = 1\nlength = 8\nstart_bit = 0\n",
               "dbc = \"" + path + "\"\nsignal = \"Report.Position\"\n", &doubt);
    return doubt;
  };
  EXPECT_EQ(doubt_of("0|32@1- (1,0)"),
            "s: Report.Position is a 32-bit integer with scale 1 in the DBC file; if the device "
            "sends a float there, its SIG_VALTYPE_ is missing");
  EXPECT_NE(doubt_of("0|32@1+ (1,0)"), "");
  EXPECT_EQ(doubt_of("0|32@1- (1,0)", "SIG_VALTYPE_ 256 Position : 1;\n"), "");
  EXPECT_EQ(doubt_of("0|32@1- (0.001,0)"), "");
  EXPECT_EQ(doubt_of("0|16@1- (1,0)"), "");
}

TEST(CanProfile, Cia402IsRefusedAtAnotherRateThanItsInterpolationTime) {
  const std::string drive = "profile = \"cia402.toml\"\ncommand = \"torque\"\nnode = 1\n";
  EXPECT_NO_THROW(remarks_of(1000.0, drive, some_sensor));
  EXPECT_THAT(
      [&] { remarks_of(500.0, drive, some_sensor); },
      testing::ThrowsMessage<ConfigError>(testing::AllOf(
          HasSubstr("cia402.toml:"),
          HasSubstr("[device] rate_hz = 1000: is what the start-up list sets the drive up for, and "
                    "[loop] rate_hz is 500: give the loop this rate, or add the steps that set up "
                    "another one to [[actuator.startup]] and rate_hz = 500 to [actuator]"))));
  EXPECT_NO_THROW(remarks_of(500.0, drive + "rate_hz = 500\n", some_sensor));
  const Step other = Laid("cia402.toml", "command", "torque",
                          "startup = [{ name = \"interpolation time 2 · 10^-3 s\", id = 0x600, "
                          "bytes = [0x2F, 0xC2, 0x60, 0x01, 0x02, 0, 0, 0], expect_id = 0x580 }]\n",
                          4)
                         .command()
                         .startup.back();
  EXPECT_EQ(other.frame->id, 0x604u) << "the node's, after the profile's steps";
  EXPECT_EQ(other.expect->pattern.id, 0x584u);
  EXPECT_THAT([&] { remarks_of(250.0, drive + "rate_hz = 500\n", some_sensor); },
              testing::ThrowsMessage<ConfigError>(HasSubstr("[actuator] rate_hz = 500")));
  EXPECT_NO_THROW(
      remarks_of(500.0, "id = 1\nlength = 8\nstart_bit = 0\n",
                 "profile = \"cia402.toml\"\nfeedback = \"position\"\nnode = 1\nunit = \"1\"\n"))
      << "nothing is set up for a sensor alone";
}

// What is said about an actuator section with these keys.
std::string refusal(const std::string& keys) {
  const auto file = RigFile::parse("[actuator]\n" + keys, "rig.toml");
  try {
    ConfigReader reader(std::nullopt, 2);
    reader.command(Keys{file->section("actuator"), devices}, 0.0);
    file->refuse_unread();
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST(CanConfig, DescribesASignalInPlace) {
  EXPECT_EQ(refusal("id = 0x10\nbytes = [1, 2, 0, 0]\nstart_bit = 16\nbits = 16\n"
                    "type = \"int\"\nscale = 0.5\nclamp_max = 5\nchecksum = \"none\"\n"),
            "");
}

TEST(CanConfig, RefusesConstantsThatTheirBitsCannotHold) {
  const std::string frame = "id = 0x10\nlength = 8\nstart_bit = 0\n";
  const auto set = [&](const std::string& rest) {
    return refusal(frame + "set = [{ start_bit = 16, bits = 8, " + rest + " }]\n");
  };
  EXPECT_EQ(set("value = 255"), "");
  EXPECT_EQ(set("scale = 0.1, value = 0.26"), "") << "rounded to the nearest code";
  EXPECT_THAT(set("value = 256"),
              HasSubstr("value = 256: is outside what the signal can hold: 255 is the nearest"));
  EXPECT_THAT(set("type = \"int\", value = -129"), HasSubstr("-128 is the nearest"));
  EXPECT_THAT(
      refusal(
          frame +
          "[[actuator.arm]]\nname = \"x\"\n"
          "id = 1\nexpect = [{ dbc = \"odrive-cansimple.dbc\", signal = \"Heartbeat.Axis_State\", "
          "value = 300 }]\n"),
      HasSubstr("is outside what the signal can hold: 255"));
}

// What goes out at every stop.
TEST(CanConfig, RefusesAClampThatNeutralDoesNotPass) {
  const std::string frame = "id = 0x10\nlength = 8\nstart_bit = 0\n";
  EXPECT_THAT(
      refusal(frame + "clamp_min = 10\nclamp_max = 20\n"),
      HasSubstr("rig.toml:5: [actuator] clamp_min = 10: cannot carry the neutral command 0: "
                "10 is the nearest that clamp_min, clamp_max"));
  EXPECT_THAT(refusal(frame + "type = \"int\"\nclamp_min = -20\nclamp_max = -10\n"),
              HasSubstr("clamp_max = -10: cannot carry the neutral command 0: -10 is the nearest"));
  EXPECT_THAT(refusal(frame + "offset = 1\n"), HasSubstr("cannot carry the neutral command 0: 1 "));
  EXPECT_EQ(refusal(frame + "bits = 12\nrange = [-10, 10]\n"), "") << "half a code beside it";
}

TEST(CanConfig, ReleaseBytesAreThoseOfTheFrame) {
  const std::string frame = "id = 0x10\nbytes = [1, 0, 0]\nstart_bit = 8\n";
  EXPECT_EQ(refusal(frame + "release_bytes = [2, 0, 0]\n"), "");
  EXPECT_THAT(refusal(frame + "release_bytes = [2, 0]\n"), HasSubstr("is as long as the frame"));
}

HealthRule health_rule(const std::string& keys) {
  const auto file = RigFile::parse(
      "[actuator]\nid = 0x10\nlength = 8\nstart_bit = 0\n[[actuator.health]]\nname = \"x\"\n" +
          keys,
      "rig.toml");
  ConfigReader reader(std::nullopt, 2);
  return reader.command(Keys{file->section("actuator"), devices}, 0.0).health.at(0);
}

TEST(CanConfig, RefusesHealthRulesThatCannotBeRead) {
  EXPECT_THAT(
      [] { health_rule("id = 3\nlength = 8\nstart_bit = 60\nbits = 8\nequals = 0\n"); },
      testing::ThrowsMessage<ConfigError>(HasSubstr("start_bit = 60: signal at bits 60|8 Intel")));
  EXPECT_THAT([] { health_rule("id = 3\nstart_bit = 60\nbits = 8\nequals = 0\n"); },
              testing::ThrowsMessage<ConfigError>(HasSubstr("byte 8 of a payload of 8 bytes")));
  EXPECT_THAT(
      [] {
        health_rule("id = 3\nfd = true\nlength = 64\nstart_bit = 500\nbits = 32\nequals = 0\n");
      },
      testing::ThrowsMessage<ConfigError>(HasSubstr("byte 66 of a payload of 64 bytes")));
  EXPECT_THAT(
      [] {
        health_rule(
            "id = 3\nlength = 8\nstart_bit = 0\ntype = \"float32\"\nbits = 16\nat_most = 80\n");
      },
      testing::ThrowsMessage<ConfigError>(HasSubstr("a float32 is 32 bits long")));
  EXPECT_THAT([] { health_rule("id = 3\nlength = 8\nstart_bit = 0\nbits = 8\nnot = 256\n"); },
              testing::ThrowsMessage<ConfigError>(HasSubstr("255 is the nearest")));
  EXPECT_TRUE(health_rule("id = 3\nfd = true\nlength = 64\nstart_bit = 480\nequals = 0\n").fd);
}

TEST(CanConfig, HealthIsEqualByCode) {
  for (const int code : {0, 1, 3, 7, 250}) {
    const HealthRule rule =
        health_rule("id = 3\nlength = 8\nstart_bit = 0\nbits = 8\nscale = 0.1\nequals = " +
                    std::to_string(0.1 * code) + "\n");
    const Bytes payload{static_cast<std::uint8_t>(code), 0, 0, 0, 0, 0, 0, 0};
    EXPECT_EQ(decode(payload, rule.signal), rule.value) << code;
  }
}

TEST(CanConfig, RefusesFeedbackOutsideOfItsFrame) {
  const auto feedback = [](const std::string& keys) {
    const auto file = RigFile::parse("[sensor]\nid = 1\n" + keys, "rig.toml");
    ConfigReader(std::nullopt, 2).feedback(Keys{file->section("sensor"), devices});
  };
  EXPECT_NO_THROW(feedback("start_bit = 48\n"));
  EXPECT_THAT([&] { feedback("start_bit = 56\n"); },
              testing::ThrowsMessage<ConfigError>(HasSubstr("byte 8 of a payload of 8 bytes")));
  EXPECT_THAT([&] { feedback("length = 4\nstart_bit = 24\n"); },
              testing::ThrowsMessage<ConfigError>(HasSubstr("byte 4 of a payload of 4 bytes")));
}

TEST(CanConfig, AnExpectedSignalIsExpectedInItsPageOfItsMessage) {
  const std::string dbc = testing::TempDir() + "can_expected_pages.dbc";
  std::ofstream(dbc) << "BO_ 256 Status: 8 X\n"
                        " SG_ Page M : 0|8@1+ (1,0) [0|0] \"\" X\n"
                        " SG_ State m1 : 8|8@1+ (1,0) [0|0] \"\" X\n"
                        " SG_ Load m1 : 16|8@1+ (1,0) [0|0] \"\" X\n"
                        " SG_ Heat m2 : 8|8@1+ (1,0) [0|0] \"\" X\n"
                        "BO_ 257 Other: 8 X\n"
                        " SG_ Z : 0|8@1+ (1,0) [0|0] \"\" X\n";
  const auto expected = [&](const std::vector<std::string>& signals) {
    std::string list;
    for (const std::string& signal : signals)
      list += (list.empty() ? "" : ", ") +
              ("{ dbc = \"" + dbc + "\", signal = \"" + signal + "\", value = 8 }");
    const auto file = RigFile::parse(
        "[actuator]\nid = 1\nlength = 8\nstart_bit = 0\n[[actuator.arm]]\nname = \"x\"\nid = "
        "2\nexpect = [" +
            list + "]\n",
        "rig.toml");
    ConfigReader reader(std::nullopt, 2);
    return reader.command(Keys{file->section("actuator"), devices}, 0.0).arm.at(0).expect->pattern;
  };
  Frame frame;
  frame.id = 256;
  frame.length = 8;
  frame.data = {2, 8, 8};
  EXPECT_FALSE(expected({"Status.State"}).matches(frame)) << "another page";
  EXPECT_FALSE(expected({"Status.State", "Status.Load"}).matches(frame));
  frame.data[0] = 1;
  EXPECT_TRUE(expected({"Status.State"}).matches(frame));
  EXPECT_TRUE(expected({"Status.State", "Status.Load"}).matches(frame));
  const auto refuses = [&](const std::vector<std::string>& signals, const char* rule) {
    EXPECT_THAT([&] { expected(signals); }, testing::ThrowsMessage<ConfigError>(HasSubstr(rule)));
  };
  refuses({"Other.Z", "Status.State"}, "is in another message than the signals before it");
  refuses({"Status.State", "Status.Heat"}, "is in another page of the message");
  refuses({}, "needs a signal at least");
}

TEST(CanConfig, TakesEveryPollAndOnlyPollsThatAskSomething) {
  const auto polls = [](const std::string& keys) {
    const auto file =
        RigFile::parse("[sensor]\nid = 1\nlength = 8\nstart_bit = 0\n" + keys, "rig.toml");
    ConfigReader reader(std::nullopt, 2);
    return reader.feedback(Keys{file->section("sensor"), devices}).polls;
  };
  EXPECT_EQ(polls("poll = [{ name = \"a\", id = 2 }, { name = \"b\", id = 3 }]\n").size(), 2u);
  EXPECT_THAT([&] { polls("poll = [{ name = \"a\" }]\n"); },
              testing::ThrowsMessage<ConfigError>(HasSubstr("needs a frame")));
}

TEST(CanConfig, AStepWithTheNeutralSetPointHasNoOtherFrame) {
  EXPECT_THAT(refusal("id = 1\nlength = 8\nstart_bit = 0\n[[actuator.arm]]\nname = \"x\"\n"
                      "neutral = true\nid = 2\n"),
              HasSubstr("give no frame beside it"));
}

TEST(CanConfig, RefusalsNameFileLineKeyAndRule) {
  EXPECT_THAT(refusal("start_bit = 0\n"), HasSubstr("rig.toml:1: [actuator] id: is missing"));
  EXPECT_THAT(refusal("id = 0x900\nlength = 8\nstart_bit = 0\n"),
              HasSubstr("rig.toml:2: [actuator] id = 0x900: identifier 2304 (with node_step · node "
                        "added) is above 0x7FF; extended = true makes it a 29-bit one"));
  EXPECT_THAT(refusal("id = 0x7FF\nnode_step = 1\nlength = 8\nstart_bit = 0\n"),
              HasSubstr("identifier 2049"));
  EXPECT_THAT(refusal("id = 1\nlength = 8\nstart_bit = 60\nbits = 8\n"),
              HasSubstr("rig.toml:4: [actuator] start_bit = 60: signal at bits 60|8 Intel"));
  EXPECT_THAT(refusal("id = 1\nlength = 8\nstart_bit = 0\nbits = 31\ntype = \"float32\"\n"),
              HasSubstr("a float32 is 32 bits long"));
  EXPECT_THAT(refusal("id = 1\nbytes = [1,2,3,4,5,6,7,8,9]\nstart_bit = 0\n"),
              HasSubstr("a classic frame has up to 8 bytes"));
  EXPECT_THAT(refusal("id = 1\nfd = true\nlength = 9\nstart_bit = 0\n"),
              HasSubstr("a payload of 9 bytes does not exist in a CAN-FD frame"));
  EXPECT_THAT(refusal("id = 1\nlength = 8\nstart_bit = 0\nrange = [1, -1]\n"),
              HasSubstr("must be [value of code 0, value of the highest code]"));
  EXPECT_THAT(refusal("id = 1\nlength = 8\nstart_bit = 0\nclamp_min = 2\nclamp_max = 1\n"),
              HasSubstr("minimum must not be above maximum"));
  EXPECT_THAT(
      refusal("id = 1\nlength = 8\nstart_bit = 0\nchecksum = \"sum8\"\nchecksum_byte = 9\n"),
      HasSubstr("byte 9 is outside a payload of 8 bytes"));
  EXPECT_THAT(refusal("id = 1\nlength = 8\nstart_bit = 0\nscael = 2\n"),
              HasSubstr("rig.toml:5: [actuator] scael: unknown key; did you mean scale?"));
  EXPECT_THAT(refusal("signal = \"A.B\"\n"), HasSubstr("give the file with dbc"));
  EXPECT_THAT(refusal("signal = \"A.B\"\ndbc = \"none.dbc\"\n"),
              HasSubstr("none.dbc: the DBC file cannot be read"));
  EXPECT_THAT(refusal("signal = \"Set_Input_Torque.Torque\"\ndbc = \"odrive-cansimple.dbc\"\n"),
              HasSubstr("rig.toml:2: [actuator] signal = 'Set_Input_Torque.Torque':"));
  EXPECT_THAT(refusal("id = 1\nlength = 8\nstart_bit = 0\n[[actuator.arm]]\nid = 2\n"),
              HasSubstr("name: is missing"));
  EXPECT_THAT(refusal("id = 1\nlength = 8\nstart_bit = 0\n[[actuator.keep_alive]]\nname = \"x\"\n"
                      "period_s = 1\n"),
              HasSubstr("needs a frame"));
  EXPECT_THAT(refusal("id = 1\nlength = 8\nstart_bit = 0\n[[actuator.health]]\nname = \"x\"\n"
                      "id = 3\nlength = 8\nstart_bit = 0\n"),
              HasSubstr("exactly one of equals, not, at_most, at_least"));
}

}  // namespace
}  // namespace sinerig::can
