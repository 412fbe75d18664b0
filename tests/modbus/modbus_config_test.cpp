#include "drivers/modbus/modbus_config.h"

#include <filesystem>

#include <gmock/gmock.h>

#include "config/rig.h"
#include "drivers/modbus/channels.h"
#include "drivers/modbus/modbus_driver.h"

namespace sinerig::modbus {
namespace {

using config::ConfigError;
using config::RigFile;
using testing::HasSubstr;

constexpr const char* tcp = "[modbus.drive]\nhost = \"10.0.0.5\"\n";
constexpr const char* actuator =
    "[actuator]\ndriver = \"modbus\"\nconnection = \"drive\"\nregister = 16\n";
constexpr const char* sensor =
    "[sensor.s]\ndriver = \"modbus\"\nconnection = \"drive\"\nregister = 34\n";

// What is said about a rig with these sections; empty when it is accepted.
std::string refusal(const std::string& sections,
                    const std::string& limits = "command_min = 0\ncommand_max = 0.5\n") {
  try {
    const config::Rig rig = config::read_rig(
        RigFile::parse("[loop]\nrate_hz = 100\n[sweep]\nstart_hz = 1\nstop_hz = 10\npoints = 3\n"
                       "amplitude = 0.1\n[limits]\n" +
                           limits + sections,
                       "rig.toml"));
    modbus_driver().configure({rig, &rig.actuator, {&rig.sensors.front()}});
    rig.file->refuse_unread();
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

std::string with(const std::string& connection, const std::string& command = "",
                 const std::string& feedback = "") {
  return connection + actuator + command + sensor + feedback;
}

TEST(ModbusConfig, AcceptsWhatTheShippedRigsSay) {
  EXPECT_EQ(refusal(with(tcp)), "");
  EXPECT_EQ(refusal(with(tcp, "type = \"int32\"\nscale = 0.001\n", "table = \"input\"\n")), "");
}

TEST(ModbusConfig, RefusalsNameFileLineKeyAndRule) {
  EXPECT_THAT(refusal(std::string{actuator} + sensor),
              HasSubstr("rig.toml:13: [actuator] connection = 'drive': there is no section "
                        "[modbus.drive]"));
  EXPECT_THAT(refusal("[modbus.other]\nhost = \"h\"\n" + std::string{actuator} + sensor),
              HasSubstr("there is no such section [modbus.NAME]; there is \"other\""));
  EXPECT_THAT(refusal(with("[modbus.drive]\n")), HasSubstr("[modbus.drive] host: is missing"));
  EXPECT_THAT(refusal(with("[modbus.drive]\ntransport = \"rtu\"\ndevice = \"/dev/x\"\n"
                           "baud = 12345\n")),
              HasSubstr("[modbus.drive] baud = 12345: must be one of 1200 2400"));
  const std::string line = "[modbus.drive]\ntransport = \"rtu\"\ndevice = \"/dev/x\"\n";
  EXPECT_EQ(refusal(with(line + "unit_id = 247\n")), "");
  EXPECT_THAT(refusal(with(line + "unit_id = 248\n")),
              HasSubstr("unit_id = 248: must be at least 1 and at most 247"));
  EXPECT_THAT(refusal(with(line, "unit_id = 255\n")),
              HasSubstr("[actuator] unit_id = 255: must be at least 1 and at most 247"));
  EXPECT_EQ(refusal(with(std::string{tcp} + "unit_id = 255\n")), "") << "usual over TCP";
  EXPECT_THAT(refusal(with(std::string{tcp} + "device = \"/dev/x\"\n")),
              HasSubstr("[modbus.drive] device: unknown key"));
  EXPECT_THAT(refusal(with(std::string{tcp} + "response_timeout_s = 0.01\n")),
              HasSubstr("response_timeout_s = 0.01: must be at least 1e-05 and at most 0.009"));
  EXPECT_THAT(refusal(with(std::string{tcp} + "exchange = \"fc6\"\n", "type = \"int32\"\n")),
              HasSubstr("[actuator] type = 'int32': function 6 writes one register"));
  EXPECT_THAT(refusal(with(tcp, "scale = 0\n")), HasSubstr("scale = 0: must not be 0"));
  EXPECT_THAT(refusal(with(tcp, "table = \"input\"\n")),
              HasSubstr("[actuator] table: unknown key"));
  EXPECT_THAT(refusal(with(tcp, "clamp_min = 2\nclamp_max = 1\n")),
              HasSubstr("clamp_min = 2: must be below clamp_max"));
  EXPECT_THAT(refusal(with(tcp, "", "type = \"float33\"\n")),
              HasSubstr("must be one of \"uint16\" \"int16\""));
  EXPECT_THAT(refusal(with(tcp, "[[actuator.arm]]\nregister = 1\nvalue = 1\n")),
              HasSubstr("[actuator.arm[1]] name: is missing"));
  EXPECT_THAT(
      refusal(with(tcp, "[[actuator.arm]]\nname = \"x\"\nregister = 1\nequals = 1\nnot = 2\n")),
      HasSubstr("stands beside another comparison"));
  EXPECT_THAT(refusal(with(tcp, "[[actuator.health]]\nname = \"x\"\nregister = 1\n")),
              HasSubstr("needs exactly one of equals, not, at_most, at_least"));
  const std::string at_the_end = std::string{tcp} + actuator +
                                 "[sensor.s]\ndriver = \"modbus\"\nconnection = \"drive\"\n"
                                 "register = 65535\ntype = \"float32\"\n";
  EXPECT_THAT(refusal(at_the_end), HasSubstr("does not end before register 65536"));
}

// What the guard admits must go out: neither half a sine, nor something else for neutral.
TEST(ModbusConfig, RefusesLimitsBeyondWhatGoesOut) {
  const auto limited = [](double low, double high) {
    return "command_min = " + std::to_string(low) + "\ncommand_max = " + std::to_string(high) +
           "\n";
  };
  EXPECT_THAT(refusal(with(tcp), limited(-0.2, 0.2)),
              HasSubstr("[actuator] type: the command goes out as 0 to 65535: set [limits] "
                        "command_min and command_max within"));
  EXPECT_THAT(refusal(with(tcp, "type = \"int16\"\nscale = 1e-4\n"), limited(-3.2768, 3.28)),
              HasSubstr("[actuator] type = 'int16': the command goes out as -3.2768 to 3.2767"));
  EXPECT_EQ(refusal(with(tcp, "type = \"int16\"\nscale = 1e-4\n"), limited(-3.2768, 3.2767)), "");
  EXPECT_EQ(refusal(with(tcp, "type = \"int16\"\nscale = -1e-4\n"), limited(-3.2767, 3.2768)), "");
  EXPECT_THAT(refusal(with(tcp, "type = \"int16\"\n"), ""),
              HasSubstr("set [limits] command_min and command_max within"));
  EXPECT_EQ(refusal(with(tcp, "type = \"float32\"\n"), ""), "");
  EXPECT_THAT(refusal(with(tcp, "type = \"float32\"\nclamp_min = 0.1\nclamp_max = 1\n"),
                      limited(-0.2, 0.2)),
              HasSubstr("[actuator] clamp_min = 0.1: the command goes out as 0.1 to 1: set"));
  EXPECT_THAT(refusal(with(tcp, "type = \"float32\"\nclamp_max = 0.1\n"), limited(-0.2, 0.2)),
              HasSubstr("[actuator] clamp_max = 0.1: the command goes out as -inf to 0.1: set"));
}

TEST(ModbusConfig, KeepsTheSilenceOfTheStandard) {
  const auto silence_ns = [](const std::string& keys) {
    const auto file = RigFile::parse(
        "[modbus.drive]\ntransport = \"rtu\"\ndevice = \"/dev/x\"\n" + keys, "rig.toml");
    return read_connection(file->children("modbus").front(), 10.0).link.connection.silence_ns;
  };
  EXPECT_EQ(silence_ns("baud = 9600\n"), 4'010'417);
  EXPECT_EQ(silence_ns("baud = 115200\n"), 1'750'000);
  EXPECT_EQ(silence_ns("silence_s = 0\n"), 0);
}

TEST(ModbusConfig, LeavesTimeInThePeriod) {
  const auto file = RigFile::parse("[modbus.drive]\nhost = \"h\"\n", "rig.toml");
  const Connection connection = read_connection(file->children("modbus").front(), 500.0);
  EXPECT_EQ(connection.link.period_ns, 2'000'000);
  EXPECT_EQ(connection.link.response_timeout_ns, 1'500'000);
  EXPECT_EQ(connection.link.connection.address(), "h:502");
}

TEST(ModbusDoubt, IsOfASweepAboveATenthOfTheExchanges) {
  LinkSettings settings;
  settings.connection.name = "drive";
  settings.period_ns = 5'000'000;
  const Link link{settings, {}};
  const Pace fast{.exchanges = 100, .median_ns = 1'000'000};
  EXPECT_EQ(doubt(link, fast, 20.0), "") << "no more exchanges than ticks";
  EXPECT_THAT(doubt(link, fast, 20.1),
              HasSubstr("[modbus.drive] 200 exchanges a second, of which the sweep's highest "
                        "frequency of 20.1 Hz is more than a tenth: above 20 Hz"));
  const Pace slow{.exchanges = 100, .median_ns = 10'000'000};
  EXPECT_EQ(doubt(link, slow, 10.0), "");
  EXPECT_THAT(doubt(link, slow, 12.0), HasSubstr("100 exchanges a second"));
  EXPECT_EQ(doubt(link, {}, 12.0), "") << "nothing was measured";
}

}  // namespace
}  // namespace sinerig::modbus
