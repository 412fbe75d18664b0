// Values of a rig file replaced in its text.
#include "config/overrides.h"

#include <gmock/gmock.h>

#include "config/section.h"

namespace sinerig::config {
namespace {

using testing::HasSubstr;

constexpr const char* text =
    "# ω in Hz\n[sweep]\nstart_hz = 0.5   # first, ≥ 0\nlist = [1,\n  2]\n\n[limits]\n"
    "[sensor.gyro]\nunit = \"°/s\"  # keep\n[[plant.modes]]\nhz = 3\n";

std::string edited(const std::string& path, const std::string& value) {
  return with_overrides(text, "rig.toml", {{path, value}});
}

std::string with(const std::string& before, const std::string& after) {
  std::string expected = text;
  return expected.replace(expected.find(before), before.size(), after);
}

TEST(Overrides, TakeThePlaceOfAValueAndLeaveTheRest) {
  EXPECT_EQ(edited("sweep.start_hz", "0.25"), with("0.5 ", "0.25 "));
  EXPECT_EQ(edited("sweep.list", "[4]"), with("[1,\n  2]", "[4]"));
  EXPECT_EQ(edited("sensor.gyro.unit", "\"rad/s\""), with("\"°/s\"", "\"rad/s\""));
  EXPECT_EQ(edited("plant.modes[0].hz", "4"), with("hz = 3", "hz = 4"));
}

TEST(Overrides, AddWhatIsNotThere) {
  EXPECT_EQ(edited("limits.command_max", "2"), with("[limits]\n", "[limits]\ncommand_max = 2\n"));
  EXPECT_EQ(edited("sensor.gyro.max", "9"), with("[sensor.gyro]\n", "[sensor.gyro]\nmax = 9\n"));
  EXPECT_EQ(edited("output.samples", "true"), std::string{text} + "\n[output]\nsamples = true\n");
}

TEST(Overrides, AreAllMade) {
  const std::string both =
      with_overrides(text, "rig.toml", {{"sweep.start_hz", "1"}, {"sweep.stop_hz", "2"}});
  EXPECT_THAT(both, HasSubstr("[sweep]\nstop_hz = 2\nstart_hz = 1 "));
}

TEST(Overrides, AreRefusedWhereTheyHaveNoPlace) {
  const auto refusal = [](const std::string& path, const std::string& value) -> std::string {
    try {
      edited(path, value);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "none";
  };
  EXPECT_EQ(refusal("amplitude", "1"),
            "rig.toml: amplitude: write section.key, such as sweep.amplitude");
  EXPECT_THAT(refusal("plant.modes", "3"), HasSubstr("plant.modes = 3 cannot be put in its place"));
}

}  // namespace
}  // namespace sinerig::config
