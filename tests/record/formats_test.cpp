// What is written can be read back: CSV and MATLAB files to the last bit, UFF 58 to its columns.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <set>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "record/exporters.h"
#include "record/mat_file.h"
#include "record/measured.h"
#include "record/point_columns.h"
#include "record/uff58.h"
#include "support/full_disk.h"
#include "support/program.h"
#include "support/stored_runs.h"

namespace sinerig::record {
namespace {

using testing::HasSubstr;

class Formats : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return (workshop_.folder() / name).string(); }

  std::string refusal(const std::string& name, const std::string& text) {
    workshop_.write(name, text);
    try {
      import_responses(path(name));
    } catch (const SweepFileError& error) {
      return error.what();
    }
    return "accepted";
  }

  test::Workshop workshop_;
  StoredRun run_ = test::two_channel_run(20);
};

void expect_same(double a, double b, const char* what) {
  if (std::isnan(a) && std::isnan(b)) return;
  EXPECT_EQ(a, b) << what;
}

void expect_same_points(const std::vector<StoredPoint>& a, const std::vector<StoredPoint>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    expect_same(a[i].frequency_hz, b[i].frequency_hz, "freq_hz");
    expect_same(a[i].response.real(), b[i].response.real(), "re");
    expect_same(a[i].response.imag(), b[i].response.imag(), "im");
    expect_same(a[i].covariance.re_re, b[i].covariance.re_re, "var_re");
    expect_same(a[i].covariance.re_im, b[i].covariance.re_im, "cov_re_im");
    expect_same(a[i].covariance.im_im, b[i].covariance.im_im, "var_im");
    for (const PointColumn& column : point_columns)
      expect_same(a[i].*column.value, b[i].*column.value, column.name);
    EXPECT_EQ(a[i].status, b[i].status);
    EXPECT_EQ(a[i].reason, b[i].reason);
    EXPECT_EQ(a[i].settled_by, b[i].settled_by);
  }
}

TEST_F(Formats, CsvLosesNothing) {
  run_.responses[1].points[3].reason = "target_not_reached";
  run_.responses[1].points[3].reason_value = 1.0 / 3.0;
  std::ofstream stream{path("a.csv")};
  write_csv(stream, run_, run_.responses[1]);
  stream.close();
  const auto back = import_responses(path("a.csv"));
  ASSERT_EQ(back.size(), 1U);
  EXPECT_EQ(back[0].output.name, "gyro");
  EXPECT_EQ(back[0].output.unit, "rad/s");
  EXPECT_EQ(back[0].input.name, "applied");
  EXPECT_EQ(back[0].input.unit, "Nm");
  expect_same_points(back[0].points, run_.responses[1].points);
}

// Its first line is all the head there is: it begins with the columns that scripts rely on, and
// says units and signs without a comma too many.
TEST_F(Formats, CsvSaysUnitsAndSignsInItsFirstLine) {
  run_.channels[1].unit = "N,m";
  std::ostringstream text;
  write_csv(text, run_, run_.responses[1]);
  std::istringstream lines{text.str()};
  std::string head;
  std::string row;
  std::getline(lines, head);
  std::getline(lines, row);
  EXPECT_THAT(head, testing::StartsWith("freq_hz,re,im,gain_db,phase_deg,"));
  EXPECT_THAT(head, testing::EndsWith(
                        ",H = Y/U; Y = b1 + j a1; y ~ a0 + a1 cos wt + b1 sin wt: negative phase "
                        "lags; re and im in rad/s per N;m; intervals are half widths of 95 %"));
  run_.channels[1].unit = "Nm";
  std::ostringstream again;
  write_csv(again, run_, run_.responses[1]);
  std::istringstream same{again.str()};
  std::getline(same, head);
  std::getline(same, row);
  EXPECT_EQ(std::count(head.begin(), head.end(), ','), std::count(row.begin(), row.end(), ','));
}

TEST_F(Formats, MatLosesNothing) {
  run_.responses[0].points[5].reason = "stuck";
  run_.channels[3].unit = "µrad/s";
  write_mat(path("a.mat"), run_, {&run_.responses[0], &run_.responses[1]});
  const auto back = import_responses(path("a.mat"));
  ASSERT_EQ(back.size(), 2U);
  EXPECT_EQ(back[0].output.name, "encoder");
  EXPECT_EQ(back[1].output.unit, "µrad/s");
  expect_same_points(back[0].points, run_.responses[0].points);
  expect_same_points(back[1].points, run_.responses[1].points);
}

TEST_F(Formats, MatRefusesResponsesOfDifferentFrequencies) {
  run_.responses[1].points.pop_back();
  try {
    write_mat(path("a.mat"), run_, {&run_.responses[0], &run_.responses[1]});
    FAIL();
  } catch (const SweepFileError& error) {
    EXPECT_THAT(error.what(), HasSubstr("do not share their frequencies"));
    EXPECT_THAT(error.what(), HasSubstr("--channel"));
  }
}

TEST_F(Formats, MatOnAFullDiskIsAnErrorAndLeavesTheFileThatWasThere) {
  const std::vector<const StoredResponse*> both{&run_.responses[0], &run_.responses[1]};
  const auto refusal = [&](const std::string& name) -> std::string {
    try {
      write_mat(path(name), run_, both);
    } catch (const SweepFileError& error) {
      return error.what();
    }
    return "written";
  };
  ASSERT_EQ(refusal("whole.mat"), "written");
  const auto size = std::filesystem::file_size(path("whole.mat"));
  workshop_.write("a.mat", "what was there");
  // Wherever the room ends: in the head, in the numbers, in the last text.
  for (const auto room : {size / 1000, size / 3, size - 1}) {
    const test::FullDisk full{room};
    EXPECT_THAT(refusal("a.mat"), HasSubstr("a.mat: cannot be written")) << room;
  }
  EXPECT_EQ(workshop_.read("a.mat"), "what was there");
  EXPECT_FALSE(workshop_.has("a.mat.part"));
  EXPECT_EQ(refusal("a.mat"), "written");
  EXPECT_EQ(import_responses(path("a.mat")).size(), 2U);
  EXPECT_FALSE(workshop_.has("a.mat.part"));
}

TEST_F(Formats, MatIsWrittenBehindALinkAndNotInPlaceOfADevice) {
  const std::vector<const StoredResponse*> one{&run_.responses[0]};
  workshop_.write("a.mat", "what was there");
  std::filesystem::create_symlink("a.mat", path("link.mat"));
  write_mat(path("link.mat"), run_, one);
  EXPECT_TRUE(std::filesystem::is_symlink(path("link.mat")));
  EXPECT_EQ(import_responses(path("a.mat")).size(), 1U);
  std::filesystem::create_symlink("/dev/full", path("full.mat"));
  try {
    write_mat(path("full.mat"), run_, one);
    FAIL();
  } catch (const SweepFileError& error) {
    EXPECT_THAT(error.what(), HasSubstr("full.mat: cannot be written: it is not a plain file"));
  }
}

TEST_F(Formats, UffKeepsWhatItsColumnsHold) {
  std::ostringstream text;
  write_uff58(text, run_, {&run_.responses[0], &run_.responses[1]}, "axis");
  workshop_.write("a.uff", text.str());
  const auto back = import_responses(path("a.uff"));
  ASSERT_EQ(back.size(), 2U);
  EXPECT_EQ(back[0].points.size(), 19U);  // one has no response
  EXPECT_EQ(back[1].output.name, "gyro");
  EXPECT_EQ(back[1].output.unit, "rad/s");
  for (std::size_t i = 0; i < back[1].points.size(); ++i) {
    const StoredPoint& written = run_.responses[1].points[i];
    EXPECT_NEAR(back[1].points[i].frequency_hz / written.frequency_hz, 1.0, 5e-10);
    EXPECT_NEAR(std::abs(back[1].points[i].response / written.response - 1.0), 0.0, 1e-12);
  }
}

TEST_F(Formats, UffKeepsItsColumns) {
  std::ostringstream text;
  write_uff58(text, run_, {&run_.responses[1]}, std::string(200, 'x'));
  std::istringstream lines{text.str()};
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    EXPECT_LE(line.size(), 80U) << number;
    if (number < 14 || line == "    -1") continue;
    EXPECT_EQ(line.size(), 53U);
    EXPECT_NE(line.substr(0, 13).find('.'), std::string::npos) << "FORTRAN would scale " << line;
  }
}

TEST_F(Formats, UffLeavesOutWhatHasNoPoint) {
  for (StoredPoint& point : run_.responses[0].points) point.response = {nan_value, nan_value};
  EXPECT_FALSE(fits_uff58(run_.responses[0]));
  EXPECT_TRUE(fits_uff58(run_.responses[1]));
  std::ostringstream text;
  write_uff58(text, run_, {&run_.responses[0], &run_.responses[1]}, "axis");
  workshop_.write("a.uff", text.str());
  const auto back = import_responses(path("a.uff"));
  ASSERT_EQ(back.size(), 1U);
  EXPECT_EQ(back[0].output.name, "gyro");
}

TEST_F(Formats, UffOfNoPointDoesNotSpoilTheOthers) {
  std::ostringstream whole;
  write_uff58(whole, run_, {&run_.responses[1]}, "axis");
  const std::string text = whole.str();
  std::string empty;
  std::istringstream lines{text};
  std::string line;
  for (int number = 1; number <= 13 && std::getline(lines, line); ++number) {
    if (number == 9) line.replace(10, 10, "         0");
    empty += line + "\n";
  }
  workshop_.write("a.uff", empty + "    -1\n" + text);
  ASSERT_EQ(import_responses(path("a.uff")).size(), 1U);
  EXPECT_THAT(refusal("b.uff", empty + "    -1\n"), HasSubstr("holds no frequency response"));
}

// A name gives way to its unit, whole characters at a time; the brackets of a unit are its own.
TEST_F(Formats, UffKeepsUnitsOfLongNamesAndUnitsWithBrackets) {
  std::string name;
  for (int i = 0; i < 40; ++i) name += "é";
  run_.channels[1].unit = "V [rms]";
  run_.channels[3] = {name + " [x]", "µrad/s [peak [to peak]]"};
  std::ostringstream text;
  write_uff58(text, run_, {&run_.responses[1]}, "axis");
  workshop_.write("a.uff", text.str());
  const auto back = import_responses(path("a.uff"));
  ASSERT_EQ(back.size(), 1U);
  EXPECT_EQ(back[0].input.name, "applied");
  EXPECT_EQ(back[0].input.unit, "V [rms]");
  EXPECT_EQ(back[0].output.unit, run_.channels[3].unit);
  EXPECT_EQ(back[0].output.name.size() % 2, 0U);
  EXPECT_GT(back[0].output.name.size(), 40U);
  EXPECT_EQ(name.rfind(back[0].output.name, 0), 0U);
  std::istringstream lines{text.str()};
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 80U) << line;
}

TEST_F(Formats, UffHoldsTenDigitsOfAFrequency) {
  struct Case {
    double frequency_hz;
    double error;
  };
  const std::vector<Case> cases{{1.0000000449e-4, 5e-9},     {9.87654321098765e-4, 5e-9},
                                {1.00000000449e-3, 5e-10},   {1.00000000449e-2, 5e-10},
                                {0.0999999999987654, 5e-10}, {0.123456789012345, 5e-10},
                                {9.99999999987654, 5e-10},   {1234.56789012345, 5e-10},
                                {98765432.1098765, 5e-10},   {9876543210.98765, 5e-10}};
  auto& points = run_.responses[1].points;
  points.resize(cases.size());
  for (std::size_t i = 0; i < cases.size(); ++i) points[i].frequency_hz = cases[i].frequency_hz;
  std::ostringstream text;
  write_uff58(text, run_, {&run_.responses[1]}, "axis");
  workshop_.write("a.uff", text.str());
  const auto back = import_responses(path("a.uff"));
  ASSERT_EQ(back[0].points.size(), cases.size());
  for (std::size_t i = 0; i < cases.size(); ++i)
    EXPECT_NEAR(back[0].points[i].frequency_hz / cases[i].frequency_hz, 1.0, cases[i].error) << i;
}

TEST_F(Formats, ReadsUffOfOtherPrograms) {
  // Single precision, even spacing, three complex values in a line.
  workshop_.write(
      "b.unv",
      "    -1\n   151\nsomething else\n    -1\n    -1\n    58\n"
      "NONE\nNONE\nNONE\nNONE\nNONE\n"
      "    4         0    0         0       NONE         1   3       NONE         1   3\n"
      "         5         4         1  1.00000E+01  5.00000E+00  0.00000E+00\n"
      "        18    0    0    0            Frequency                   Hz\n"
      "        12    0    0    0         Acceleration                    g\n"
      "        13    0    0    0                Force                    N\n"
      "         0    0    0    0                 NONE                 NONE\n"
      "  1.00000E+00 -2.00000E+00  3.00000E+00 -4.00000E+00  5.00000E+00 -6.00000E+00\n"
      "  7.00000D+00 -8.00000D+00\n"
      "    -1\n");
  const auto back = import_responses(path("b.unv"));
  ASSERT_EQ(back.size(), 1U);
  ASSERT_EQ(back[0].points.size(), 4U);
  EXPECT_EQ(back[0].points[3].frequency_hz, 25.0);
  EXPECT_EQ(back[0].points[3].response, std::complex<double>(7.0, -8.0));
  EXPECT_EQ(back[0].output.unit, "g");
}

TEST_F(Formats, ReadsPlainCsv) {
  EXPECT_THAT(refusal("c.csv", "1,1,0,0.1\n10,x,0,0.1\n"),
              HasSubstr("c.csv:2: re is \"x\"; wanted a number"));
  EXPECT_THAT(refusal("c.csv", "0,5;0,2;-0,1\n"), HasSubstr("c.csv:1: the numbers have decimal"));
  workshop_.write("d.csv", "10,0.5,-0.5,0.1\n1,1,0,0.1\n");
  const auto plain = import_responses(path("d.csv"));
  ASSERT_EQ(plain[0].points.size(), 2U);
  EXPECT_EQ(plain[0].points[0].frequency_hz, 1.0);  // sorted
  EXPECT_DOUBLE_EQ(plain[0].points[0].covariance.im_im, 0.01);
  EXPECT_TRUE(std::isinf(plain[0].points[0].dof));
  EXPECT_EQ(plain[0].points[0].status, "imported");
}

TEST_F(Formats, ReadsCsvAsASpreadsheetQuotesIt) {
  workshop_.write(
      "q.csv", "\"# by hand, in a hurry\"\n\"# output: gyro [rad/s]\"\n1,1,0\n\"\"\n2,1,0,0.1\n");
  const auto quoted = import_responses(path("q.csv"));
  ASSERT_EQ(quoted[0].points.size(), 2U);
  EXPECT_EQ(quoted[0].output.name, "gyro");
  EXPECT_EQ(quoted[0].points[0].dof, 0.0);
  EXPECT_DOUBLE_EQ(quoted[0].points[1].covariance.re_re, 0.01);
}

TEST_F(Formats, ReadsPolarCsvInRadPerSecond) {
  workshop_.write("p.csv", "# by hand\nomega_rad_s;gain_db;phase_deg\n6.283185307179586;20;-90\n");
  const auto polar = import_responses(path("p.csv"));
  EXPECT_DOUBLE_EQ(polar[0].points[0].frequency_hz, 1.0);
  EXPECT_NEAR(std::abs(polar[0].points[0].response - std::complex<double>(0.0, -10.0)), 0.0, 1e-14);
  EXPECT_EQ(polar[0].points[0].dof, 0.0);
}

TEST_F(Formats, RefusesWithPlaceAndRule) {
  EXPECT_THAT(refusal("a.csv", "freq,re,im\n1,2,3\n"),
              HasSubstr("a.csv:1: the header has no column freq_hz"));
  EXPECT_THAT(refusal("a.csv", "freq_hz,gain,phase\n1,2,3\n"),
              HasSubstr("a.csv:1: the header has no column phase_deg"));
  EXPECT_THAT(refusal("a.csv", "freq_hz,re,im\n0,2,3\n"),
              HasSubstr("a.csv: has no point at a frequency above zero"));
  EXPECT_THAT(refusal("a.csv", "# nothing\n"), HasSubstr("holds no point"));
  EXPECT_THAT(refusal("a.mat", "no MATLAB"), HasSubstr("is not a MATLAB file"));
  EXPECT_THAT(refusal("a.uff", "    -1\n    58b\n"), HasSubstr("written as ASCII"));
  EXPECT_THAT(refusal("a.uff", "nothing"), HasSubstr("holds no frequency response"));
  EXPECT_THAT(refusal("a.xls", ""), HasSubstr("has to be .sweep, .csv"));
  EXPECT_THROW(import_responses(path("none.csv")), SweepFileError);
}

TEST_F(Formats, ATruncatedUffIsNotHalfARun) {
  std::ostringstream text;
  write_uff58(text, run_, {&run_.responses[1]}, "axis");
  const std::string half = text.str().substr(0, text.str().size() / 2);
  const std::string whole_lines = half.substr(0, half.rfind('\n') + 1);
  EXPECT_THAT(refusal("h.uff", whole_lines), HasSubstr("the data end before the last point"));
}

// Whoever fits or closes a loop around an exported response has to know the hold that is in it.
TEST_F(Formats, TheRateOfTheHoldGoesAlong) {
  run_.responses[0].hold_rate_hz = 0.0;
  run_.responses[1].hold_rate_hz = 1234.5;
  std::ofstream csv{path("a.csv")};
  write_csv(csv, run_, run_.responses[1]);
  csv.close();
  EXPECT_EQ(import_responses(path("a.csv"))[0].hold_rate_hz, 1234.5);
  EXPECT_EQ(read_measured(path("a.csv")).plan.rate_hz, 1234.5);
  const std::vector<const StoredResponse*> both{&run_.responses[0], &run_.responses[1]};
  write_mat(path("a.mat"), run_, both);
  std::ofstream uff{path("a.uff")};
  write_uff58(uff, run_, both, "a");
  uff.close();
  for (const char* name : {"a.mat", "a.uff"}) {
    const auto back = import_responses(path(name));
    ASSERT_EQ(back.size(), 2U) << name;
    EXPECT_EQ(back[0].hold_rate_hz, 0.0) << name;
    EXPECT_EQ(back[1].hold_rate_hz, 1234.5) << name;
  }
}

TEST_F(Formats, PairsThatWereNotMeasuredDoNotComeBack) {
  run_.responses[1].input = 2;  // gyro over encoder, encoder over applied: two of four places
  write_mat(path("a.mat"), run_, {&run_.responses[0], &run_.responses[1]});
  const auto back = import_responses(path("a.mat"));
  ASSERT_EQ(back.size(), 2U);
  EXPECT_EQ(back[0].output.name, "encoder");
  EXPECT_EQ(back[0].input.name, "applied");
  EXPECT_EQ(back[1].output.name, "gyro");
  EXPECT_EQ(back[1].input.name, "encoder");
}

TEST_F(Formats, PointsWithoutAFrequencyAreLeftOutAndCounted) {
  run_.responses[1].points[0].frequency_hz = 0.0;
  run_.responses[1].points[1].frequency_hz = -1.0;
  run_.responses[1].points[2].frequency_hz = std::numeric_limits<double>::infinity();
  write_mat(path("a.mat"), run_, {&run_.responses[1]});
  const StoredRun back = read_measured(path("a.mat"));
  EXPECT_EQ(back.responses[0].points.size(), 17U);
  EXPECT_EQ(back.fact(left_out_fact), "3");
  for (StoredPoint& point : run_.responses[1].points) point.frequency_hz = 0.0;
  write_mat(path("none.mat"), run_, {&run_.responses[1]});
  EXPECT_THROW(import_responses(path("none.mat")), SweepFileError);
}

// Network analysers begin at 0 Hz.
TEST_F(Formats, APointAtZeroHertzIsLeftOutAndCountedInEveryFormat) {
  workshop_.write("a.csv", "freq_hz,re,im\n0,1,0\n,1,0\n1,2,3\n");
  const StoredRun csv = read_measured(path("a.csv"));
  ASSERT_EQ(csv.responses[0].points.size(), 1U);
  EXPECT_EQ(csv.fact(left_out_fact), "2");
  run_.responses[1].points[0].frequency_hz = 0.0;
  std::ostringstream text;
  write_uff58(text, run_, {&run_.responses[1]}, "axis");
  workshop_.write("a.uff", text.str());
  const StoredRun uff = read_measured(path("a.uff"));
  EXPECT_EQ(uff.responses[0].points.size(), 19U);
  EXPECT_EQ(uff.fact(left_out_fact), "1");
}

// Programs of long ago write ° and µ as one byte, which JSON cannot hold.
TEST_F(Formats, TextThatIsNotUtf8IsTakenForLatin1) {
  workshop_.write("a.csv",
                  "# output: N\xE4herung [\xB0]\nfreq_hz,re,im,reason\n1,1,0,\xB5 too large\n");
  const StoredRun run = read_measured(path("a.csv"));
  EXPECT_EQ(run.channels.at(2).name, "Näherung");
  EXPECT_EQ(run.channels[2].unit, "°");
  EXPECT_EQ(run.responses[0].points[0].reason, "µ too large");
  std::ostringstream text;
  write_uff58(text, run, {&run.responses[0]}, "axis");
  std::string latin = text.str();
  for (std::size_t at = 0; (at = latin.find("°")) != std::string::npos;) latin.erase(at, 1);
  workshop_.write("a.uff", latin);
  EXPECT_EQ(import_responses(path("a.uff"))[0].output.unit, "°");
}

// All that to_string() has a word for; behind the last value it has none.
template <typename Enum>
std::set<std::string> words() {
  std::set<std::string> all;
  const std::string none = to_string(static_cast<Enum>(UINT8_MAX));
  for (std::uint8_t i = 0; to_string(static_cast<Enum>(i)) != none; ++i)
    all.insert(to_string(static_cast<Enum>(i)));
  return all;
}

TEST_F(Formats, TheSchemaOfTheJsonKnowsEveryWordOfARun) {
  std::ifstream file{SINERIG_SOURCE_DIR "/docs/sinerig-sweep.schema.json"};
  const auto known = nlohmann::json::parse(file)["definitions"]["run_words"]["properties"];
  EXPECT_EQ(known["status"]["enum"].get<std::set<std::string>>(), words<PointStatus>());
  std::set<std::string> settled_by = words<SettledBy>();
  settled_by.insert("");  // a file from before it was kept
  EXPECT_EQ(known["settled_by"]["enum"].get<std::set<std::string>>(), settled_by);
}

TEST_F(Formats, JsonTakesAnyText) {
  run_.facts["rig_text"] = "# 5 \xB0 to each side";
  run_.responses[1].points[3].reason = "half a character: \xC3";
  std::ostringstream text;
  write_json(text, run_);
  const auto document = nlohmann::json::parse(text.str());
  EXPECT_EQ(document["rig"]["text"], "# 5 \xEF\xBF\xBD to each side");
}

TEST_F(Formats, ANameWithACommaDoesNotShiftTheColumns) {
  run_.channels[3] = {"gyro, \"left\"", "rad/s, rms"};
  std::ofstream stream{path("a.csv")};
  write_csv(stream, run_, run_.responses[1]);
  stream.close();
  const auto back = import_responses(path("a.csv"));
  EXPECT_EQ(back[0].output.name, "gyro; 'left'");
  EXPECT_EQ(back[0].output.unit, "rad/s; rms");
  expect_same_points(back[0].points, run_.responses[1].points);
}

TEST_F(Formats, CsvOfASpreadsheetHasAMarkAndQuotes) {
  workshop_.write("a.csv", "\xEF\xBB\xBF\"freq_hz\",\"re\",\"im\"\r\n\"1\",2,\"3\"\r\n");
  const auto back = import_responses(path("a.csv"));
  ASSERT_EQ(back[0].points.size(), 1U);
  EXPECT_EQ(back[0].points[0].frequency_hz, 1.0);
  EXPECT_EQ(back[0].points[0].response, (std::complex<double>{2.0, 3.0}));
}

}  // namespace
}  // namespace sinerig::record
