// What a rig file is told when it is wrong: file, line, section, key, value and rule.
#include "config/section.h"

#include <functional>

#include <gtest/gtest.h>

namespace sinerig::config {
namespace {

// The message for line 2 of a file that holds "[s]" and `line`.
std::string refusal(const std::string& line, const std::function<void(const Section&)>& read) {
  const auto file = RigFile::parse("[s]\n" + line + "\n", "rig.toml");
  try {
    read(file->section("s"));
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

std::string number_refusal(const std::string& line, Range range) {
  return refusal(line, [=](const Section& s) { s.number("k", range); });
}

TEST(Number, IsRefusedOutsideOfItsRangeWithTheRule) {
  EXPECT_EQ(number_refusal("k = -1", above_zero), "rig.toml:2: [s] k = -1: must be above 0");
  EXPECT_EQ(number_refusal("k = 0", above_zero), "rig.toml:2: [s] k = 0: must be above 0");
  EXPECT_EQ(number_refusal("k = -0.5", zero_or_more),
            "rig.toml:2: [s] k = -0.5: must be at least 0");
  EXPECT_EQ(number_refusal("k = 1.5", fraction_of_one),
            "rig.toml:2: [s] k = 1.5: must be at least 0 and at most 1");
  EXPECT_EQ(number_refusal("k = 7", {.max = 5.0, .open_max = true}),
            "rig.toml:2: [s] k = 7: must be below 5");
  EXPECT_EQ(number_refusal("k = inf", any_number),
            "rig.toml:2: [s] k = inf: must be a finite number");
  EXPECT_EQ(number_refusal("k = nan", any_number),
            "rig.toml:2: [s] k = nan: must be a finite number");
}

TEST(Number, IsRefusedWhereItIsMissingOrNoNumber) {
  EXPECT_EQ(number_refusal("", above_zero), "rig.toml:1: [s] k: is missing; it must be above 0");
  EXPECT_EQ(number_refusal("k = \"1\"", above_zero),
            "rig.toml:2: [s] k = '1': must be a number, is a string");
  EXPECT_EQ(number_refusal("k = [1]", above_zero),
            "rig.toml:2: [s] k = [1]: must be a number, is an array");
  EXPECT_EQ(number_refusal("k = true", above_zero),
            "rig.toml:2: [s] k = true: must be a number, is true or false");
  EXPECT_EQ(number_refusal("k = 1979-05-27", above_zero),
            "rig.toml:2: [s] k = 1979-05-27: must be a number, is a date or time");
}

TEST(Number, IsTakenWithinItsRangeAndFallsBackWhereItIsMissing) {
  const auto file = RigFile::parse("[s]\na = 2\nb = 2.5\nc = inf\n", "rig.toml");
  const Section s = file->section("s");
  EXPECT_EQ(s.number("a", above_zero), 2.0);
  EXPECT_EQ(s.number("b", above_zero, 7.0), 2.5);
  EXPECT_EQ(s.number("missing", above_zero, 7.0), 7.0);
  EXPECT_EQ(s.number("c", above_zero_or_unlimited), std::numeric_limits<double>::infinity());
}

TEST(Number, ThatMayBeUnlimitedIsStillNoNan) {
  EXPECT_EQ(number_refusal("k = nan", above_zero_or_unlimited),
            "rig.toml:2: [s] k = nan: must be above 0");
  EXPECT_EQ(number_refusal("k = -inf", above_zero_or_unlimited),
            "rig.toml:2: [s] k = -inf: must be above 0");
}

TEST(Integer, IsRefusedWithAFraction) {
  EXPECT_EQ(refusal("k = 2.5", [](const Section& s) { s.integer("k", zero_or_more); }),
            "rig.toml:2: [s] k = 2.5: must be a whole number");
  EXPECT_EQ(refusal("k = -2", [](const Section& s) { s.integer("k", zero_or_more, 3); }),
            "rig.toml:2: [s] k = -2: must be at least 0");
}

TEST(Flag, IsTrueOrFalse) {
  EXPECT_EQ(refusal("k = 1", [](const Section& s) { s.flag("k", false); }),
            "rig.toml:2: [s] k = 1: must be true or false, is a number");
}

TEST(Text, IsAString) {
  const auto text = [](const Section& s) {
    s.text("k");
  };
  EXPECT_EQ(refusal("k = 1", text), "rig.toml:2: [s] k = 1: must be a string, is a number");
  EXPECT_EQ(refusal("", text), "rig.toml:1: [s] k: is missing; it must be a string");
}

TEST(Choice, NamesEveryOption) {
  EXPECT_EQ(refusal("k = \"c\"",
                    [](const Section& s) {
                      s.choice("k", {"a", "b"});
                    }),
            "rig.toml:2: [s] k = 'c': must be one of \"a\" \"b\"");
}

TEST(Numbers, AreAnArrayOfNumbersInTheirRange) {
  const auto numbers = [](const Section& s) {
    s.numbers("k", above_zero);
  };
  EXPECT_EQ(refusal("k = 3", numbers), "rig.toml:2: [s] k = 3: must be an array of numbers");
  EXPECT_EQ(refusal("k = [1, \"a\"]", numbers),
            "rig.toml:2: [s] k = [1, 'a']: must hold numbers only");
  EXPECT_EQ(refusal("k = [1, -1]", numbers),
            "rig.toml:2: [s] k = [1, -1]: every entry must be above 0");
  EXPECT_EQ(refusal("", numbers), "rig.toml:1: [s] k: is missing; it must be an array of numbers");
}

TEST(Rows, AreAnArrayOfArrays) {
  const auto rows = [](const Section& s) {
    s.rows("k", any_number);
  };
  EXPECT_EQ(refusal("k = [1]", rows),
            "rig.toml:2: [s] k = [1]: must be an array of arrays of numbers");
  EXPECT_EQ(refusal("k = [[true]]", rows), "rig.toml:2: [s] k = [[true]]: must hold numbers only");
}

TEST(Texts, AreAnArrayOfStrings) {
  const auto texts = [](const Section& s) {
    s.texts("k");
  };
  EXPECT_EQ(refusal("k = \"a\"", texts), "rig.toml:2: [s] k = 'a': must be an array of strings");
  EXPECT_EQ(refusal("k = [1]", texts), "rig.toml:2: [s] k = [1]: must hold strings only");
}

TEST(Roots, AreNumbersAndPairs) {
  const auto roots = [](const Section& s) {
    s.roots("k");
  };
  const std::string rule = ": must be an array of numbers and [re, im] pairs (rad/s)";
  EXPECT_EQ(refusal("k = 1", roots), "rig.toml:2: [s] k = 1" + rule);
  EXPECT_EQ(refusal("k = [[1, 2, 3]]", roots), "rig.toml:2: [s] k = [[1, 2, 3]]" + rule);
  EXPECT_EQ(refusal("k = [[1, \"2\"]]", roots), "rig.toml:2: [s] k = [[1, '2']]" + rule);
  EXPECT_EQ(refusal("k = [\"1\"]", roots), "rig.toml:2: [s] k = ['1']" + rule);
  const auto file = RigFile::parse("[s]\nk = [-1, [-2, 3]]\n", "rig.toml");
  const auto read = file->section("s").roots("k");
  ASSERT_EQ(read.size(), 2U);
  EXPECT_EQ(read[0], std::complex<double>(-1.0, 0.0));
  EXPECT_EQ(read[1], std::complex<double>(-2.0, 3.0));
}

TEST(Tables, AreAnArrayOfTables) {
  EXPECT_EQ(refusal("k = [1]", [](const Section& s) { s.tables("k"); }),
            "rig.toml:2: [s] k = [1]: must be an array of tables");
  const auto file = RigFile::parse("[s]\n[[s.k]]\na = 1\n[[s.k]]\na = -2\n", "rig.toml");
  const auto tables = file->section("s").tables("k");
  ASSERT_EQ(tables.size(), 2U);
  try {
    tables[1].number("a", above_zero);
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_STREQ(error.what(), "rig.toml:5: [s.k[2]] a = -2: must be above 0");
  }
}

std::string file_refusal(
    const std::string& text, const std::function<void(RigFile&)>& read = [](RigFile&) {}) {
  try {
    const auto file = RigFile::parse(text, "rig.toml");
    read(*file);
    file->refuse_unread();
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST(RigFile, ThatCannotBeParsedIsRefusedWithLineAndColumn) {
  EXPECT_EQ(file_refusal("[loop]\nrate_hz = = 3\n").substr(0, 14), "rig.toml:2:11:");
  EXPECT_EQ(file_refusal("[loop\n").substr(0, 11), "rig.toml:1:");
  EXPECT_EQ(file_refusal("[a]\nk = 1\nk = 2\n").substr(0, 11), "rig.toml:3:");
}

TEST(RigFile, ThatCannotBeReadIsRefused) {
  try {
    RigFile::load("/nowhere/rig.toml");
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_STREQ(error.what(), "/nowhere/rig.toml: cannot be read; is the path right?");
  }
  try {
    RigFile::load(testing::TempDir());
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_EQ(error.what(), testing::TempDir() + ": reading it failed; is it a file?");
  }
}

TEST(RigFile, RefusesKeysThatNobodyHasReadWithTheNearestName) {
  const auto read = [](RigFile& file) {
    const Section s = file.section("sweep");
    s.number("start_hz", above_zero, 1.0);
    s.number("stop_hz", above_zero, 1.0);
  };
  EXPECT_EQ(file_refusal("[sweep]\n\nstrat_hz = 3\n", read),
            "rig.toml:3: [sweep] strat_hz: unknown key; did you mean start_hz?");
  EXPECT_EQ(file_refusal("[sweep]\nxyzzy_quux = 3\n", read),
            "rig.toml:2: [sweep] xyzzy_quux: unknown key");
  EXPECT_EQ(file_refusal("[sweep]\n[swep]\na = 1\n", read),
            "rig.toml:2: [swep]: unknown section; did you mean sweep?");
  EXPECT_EQ(file_refusal("[sweep]\nstart_hz = 1\n", read), "");
}

TEST(RigFile, SuspectsASlipOfTheFingerWhereAKeyIsMissing) {
  const auto read = [](RigFile& file) {
    const Section s = file.section("sweep");
    s.number("start_hz", above_zero);
    s.number("points", above_zero);
  };
  for (const char* slip : {"strat_hz", "start_h", "start_hzz", "stert_hz", "Start_Hz"}) {
    EXPECT_EQ(file_refusal("[sweep]\n\n" + std::string{slip} + " = 3\n", read),
              "rig.toml:3: [sweep] " + std::string{slip} + ": unknown key; did you mean start_hz?");
  }
  EXPECT_EQ(file_refusal("[Sweep]\nstart_hz = 3\n", read),
            "rig.toml:1: [Sweep]: unknown section; did you mean sweep?");
  // A key that is only to be read later is none, nor one that is alike by its kind alone.
  EXPECT_EQ(file_refusal("[sweep]\nstop_hz = 3\n", read),
            "rig.toml:1: [sweep] start_hz: is missing; it must be above 0");
}

TEST(RigFile, RefusesUnknownKeysInArraysOfTables) {
  const auto read = [](RigFile& file) {
    for (const Section& mode : file.section("plant").tables("modes")) {
      mode.number("damping", above_zero);
    }
  };
  EXPECT_EQ(file_refusal("[plant]\n[[plant.modes]]\ndamping = 1\n[[plant.modes]]\n"
                         "damping = 1\ndampin = 2\n",
                         read),
            "rig.toml:6: [plant.modes[2]] dampin: unknown key; did you mean damping?");
}

TEST(RigFile, NamesAMissingSection) {
  EXPECT_EQ(file_refusal("a = 1\n", [](RigFile& file) { file.section("loop"); }),
            "rig.toml: the section [loop] is missing");
  EXPECT_EQ(file_refusal("loop = 1\n", [](RigFile& file) { file.section("loop"); }),
            "rig.toml:1: loop: must be a section, write [loop]");
  EXPECT_EQ(file_refusal("[sensor]\nx = 1\n", [](RigFile& file) { file.children("sensor"); }),
            "rig.toml:2: [sensor] x: must be a section, write [sensor.NAME]");
}

TEST(RigFile, KeepsTheOrderOfItsSensors) {
  const auto file = RigFile::parse("[sensor.z]\n[sensor.a]\n[sensor.m]\n", "rig.toml");
  std::vector<std::string> names;
  for (const Section& section : file->children("sensor")) names.push_back(section.name());
  EXPECT_EQ(names, (std::vector<std::string>{"sensor.z", "sensor.a", "sensor.m"}));
}

}  // namespace
}  // namespace sinerig::config
