// Other programs get the same H out of what is exported.
#include <cmath>
#include <complex>
#include <cstdint>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "record/exporters.h"
#include "record/fit_store.h"
#include "record/sweep_reader.h"
#include "support/program.h"
#include "support/stored_runs.h"

namespace sinerig {
namespace {

using testing::HasSubstr;

// A run with whatever may stand in one.
record::StoredRun a_run_of_every_word() {
  record::StoredRun run = test::two_channel_run(40);
  const auto name_points = [&](std::string record::StoredPoint::*word, auto first) {
    using Enum = decltype(first);
    const std::string none = to_string(static_cast<Enum>(UINT8_MAX));
    for (std::uint8_t i = 0; to_string(static_cast<Enum>(i)) != none; ++i)
      run.responses[1].points.at(i).*word = to_string(static_cast<Enum>(i));
  };
  name_points(&record::StoredPoint::status, PointStatus{});
  name_points(&record::StoredPoint::reason, PointReason{});
  name_points(&record::StoredPoint::settled_by, SettledBy{});
  const std::string none = to_string(static_cast<EventKind>(UINT8_MAX));
  for (std::uint8_t i = 0; to_string(static_cast<EventKind>(i)) != none; ++i) {
    run.events.push_back({.tick = i,
                          .dwell = 0,
                          .kind = to_string(static_cast<EventKind>(i)),
                          .channel = i % 4U,
                          .fault = i % 2 == 0 ? "none" : "stale",
                          .value = i % 3 == 0 ? std::nan("") : 1.0,
                          .detail = i % 5 == 0 ? "" : "why"});
  }
  for (const char* outcome : {"done", "interrupted", "stopped", "killed", ""})
    run.parts.push_back({.started_utc = "2026-03-01T22:14:05Z",
                         .finished_utc = "",
                         .outcome = outcome,
                         .detail = "",
                         .first_dwell = 0,
                         .first_tick = 0});
  run.timings.back().usage.reset();
  run.lag_s[0] = 0.25;
  return run;
}

class Exchange : public testing::Test {
 protected:
  void SetUp() override {
    const auto run = workshop_.sinerig("run " SINERIG_SOURCE_DIR
                                       "/config/two-mass.toml -o axis.sweep --no-report");
    ASSERT_EQ(run.exit_code, 0) << run.errors;
    run_ = record::read_sweep((workshop_.folder() / "axis.sweep").string());
  }

  bool here(const std::string& program) const {
    return workshop_.shell("command -v " + program).exit_code == 0;
  }

  // Lines "freq_hz re im" against the points of the first response.
  void expect_response(const std::string& text, double tolerance) const {
    std::istringstream stream{text};
    for (const record::StoredPoint& point : run_.responses.front().points) {
      double frequency_hz = 0.0;
      double re = 0.0;
      double im = 0.0;
      ASSERT_TRUE(stream >> frequency_hz >> re >> im) << text;
      EXPECT_NEAR(frequency_hz / point.frequency_hz, 1.0, tolerance);
      EXPECT_LE(std::abs(std::complex<double>{re, im} - point.response),
                tolerance * std::abs(point.response));
    }
  }

  test::Workshop workshop_;
  record::StoredRun run_;
};

TEST_F(Exchange, OctaveReadsTheMatlabFile) {
  if (!here("octave-cli")) GTEST_SKIP() << "no Octave here (Debian: apt install octave)";
  ASSERT_EQ(workshop_.sinerig("export axis.sweep --format mat -o axis.mat").exit_code, 0);
  workshop_.write("check.m", R"m(
s = load('axis.mat');
assert(size(s.ResponseData), [2 1 numel(s.Frequency)]);
assert(size(s.CovarianceData), [2 1 numel(s.Frequency) 2 2]);
assert(s.OutputName{2}, 'load');
assert(s.FrequencyUnit, 'Hz');
h = squeeze(s.ResponseData(1, 1, :));
printf('%.17g %.17g %.17g\n', [s.Frequency real(h) imag(h)]');
)m");
  const auto octave = workshop_.shell("octave-cli --no-init-file check.m");
  EXPECT_EQ(octave.exit_code, 0) << octave.errors;
  expect_response(octave.output, 1e-12);
}

TEST_F(Exchange, OctaveReadsTheCsv) {
  if (!here("octave-cli")) GTEST_SKIP() << "no Octave here (Debian: apt install octave)";
  ASSERT_EQ(workshop_.sinerig("export axis.sweep -o axis.csv").exit_code, 0);
  workshop_.write("check.m", R"m(
c = textscan(fopen('axis.csv'), '%f %f %f %*[^\n]', 'Delimiter', ',', 'HeaderLines', 1);
printf('%.17g %.17g %.17g\n', [c{1} c{2} c{3}]');
)m");
  const auto octave = workshop_.shell("octave-cli --no-init-file check.m");
  EXPECT_EQ(octave.exit_code, 0) << octave.errors;
  expect_response(octave.output, 1e-12);
}

// What spreadsheets and scripts do without being told anything: one line of names, then rows.
TEST_F(Exchange, OctaveReadsTheCsvAsAPlainTable) {
  if (!here("octave-cli")) GTEST_SKIP() << "no Octave here (Debian: apt install octave)";
  ASSERT_EQ(workshop_.sinerig("export axis.sweep -o axis.csv").exit_code, 0);
  workshop_.write("check.m", R"m(
t = csvread('axis.csv', 1, 0);
s = load('axis.mat');
assert(rows(t), numel(s.Frequency));
d = importdata('axis.csv', ',', 1);
assert(d.data(:, 1:3), t(:, 1:3));
printf('%.17g %.17g %.17g\n', t(:, 1:3)');
)m");
  ASSERT_EQ(workshop_.sinerig("export axis.sweep --format mat -o axis.mat").exit_code, 0);
  const auto octave = workshop_.shell("octave-cli --no-init-file check.m");
  EXPECT_EQ(octave.exit_code, 0) << octave.errors;
  expect_response(octave.output, 1e-12);
}

TEST_F(Exchange, PythonReadsTheCsv) {
  if (workshop_.shell("/usr/bin/python3 -c 'import numpy'").exit_code != 0)
    GTEST_SKIP() << "no numpy here (Debian: apt install python3-scipy)";
  ASSERT_EQ(workshop_.sinerig("export axis.sweep -o axis.csv").exit_code, 0);
  workshop_.write("read.py", R"py(
import csv, numpy
rows = list(csv.DictReader(open('axis.csv', newline='')))
assert all(None not in row and None not in row.values() for row in rows)
table = numpy.genfromtxt('axis.csv', delimiter=',', names=True, dtype=None, encoding='utf-8')
assert len(table) == len(rows)
assert table['coherence'].min() > 0 and table['coherence'].max() <= 1
assert set(table['status']) == {'good'}
try:
    import pandas
except ImportError:
    pandas = None
if pandas:
    frame = pandas.read_csv('axis.csv', float_precision='round_trip')
    assert list(frame.columns[:5]) == ['freq_hz', 're', 'im', 'gain_db', 'phase_deg']
    assert (frame['re'].to_numpy() == table['re']).all()
for row, entry in zip(rows, table):
    assert float(row['re']) == entry['re']
    print(row['freq_hz'], row['re'], row['im'])
)py");
  const auto python = workshop_.shell("/usr/bin/python3 read.py");
  EXPECT_EQ(python.exit_code, 0) << python.errors;
  expect_response(python.output, 1e-12);
}

TEST_F(Exchange, OctaveRunsTheMatlabSnippet) {
  if (!here("octave-cli")) GTEST_SKIP() << "no Octave here (Debian: apt install octave)";
  ASSERT_EQ(workshop_.sinerig("export axis.sweep --format snippet -o axis.m").exit_code, 0);
  const auto octave = workshop_.shell(
      "octave-cli --no-init-file --eval \"axis_file = 'axis.m'; source(axis_file); "
      "printf('%.17g %.17g %.17g\\n', [freq_hz real(H) imag(H)]');\"");
  EXPECT_EQ(octave.exit_code, 0) << octave.errors;
  expect_response(octave.output, 1e-12);
}

TEST_F(Exchange, PythonRunsTheSnippet) {
  if (workshop_.shell("/usr/bin/python3 -c 'import scipy'").exit_code != 0)
    GTEST_SKIP() << "no scipy here (Debian: apt install python3-scipy)";
  ASSERT_EQ(workshop_.sinerig("export axis.sweep --format snippet -o axis.py").exit_code, 0);
  const auto python = workshop_.shell(
      "/usr/bin/python3 -c \"from axis import *; [print(repr(f), repr(h.real), repr(h.imag)) "
      "for f, h in zip(freq_hz.tolist(), H.tolist())]; misfit([1.0], [1.0, 1.0], 0.001)\"");
  EXPECT_EQ(python.exit_code, 0) << python.errors;
  expect_response(python.output, 1e-12);
}

// The fixed columns of the format, read by other code than ours.
TEST_F(Exchange, PythonReadsTheUff) {
  if (!here("/usr/bin/python3")) GTEST_SKIP() << "no Python here";
  ASSERT_EQ(workshop_.sinerig("export axis.sweep --format uff -o axis.uff").exit_code, 0);
  workshop_.write("read.py", R"py(
lines = open('axis.uff').read().split('    -1\n')[1].splitlines()
assert lines[0].strip() == '58'
assert int(lines[6][0:5]) == 4
assert [int(lines[7][i:i + 10]) for i in (0, 20)] == [6, 0]
count = int(lines[7][10:20])
data = lines[12:12 + count]
assert len(lines) == 12 + count
for line in data:
    print(line[0:13], line[13:33], line[33:53])
)py");
  const auto python = workshop_.shell("/usr/bin/python3 read.py");
  EXPECT_EQ(python.exit_code, 0) << python.errors;
  expect_response(python.output, 5e-10);
}

TEST_F(Exchange, JsonFollowsItsSchema) {
  if (workshop_.shell("/usr/bin/python3 -c 'import jsonschema'").exit_code != 0)
    GTEST_SKIP() << "no jsonschema here (Debian: apt install python3-jsonschema)";
  ASSERT_EQ(workshop_.sinerig("export axis.sweep --format json -o axis.json").exit_code, 0);
  workshop_.write("other.csv", "freq_hz,re,im,status,settled_by\n1,1,0,fine,by itself\n");
  ASSERT_EQ(workshop_.sinerig("export other.csv --format json -o other.json").exit_code, 0);
  std::ostringstream every;
  record::write_json(every, a_run_of_every_word());
  workshop_.write("every.json", every.str());
  workshop_.write("validate.py", R"py(
import json, sys, jsonschema
schema = json.load(open(sys.argv[1]))
jsonschema.Draft7Validator.check_schema(schema)
for name in ('axis.json', 'every.json', 'other.json'):
    document = json.load(open(name))
    try:
        jsonschema.validate(document, schema)
    except jsonschema.ValidationError as error:
        sys.exit(f'{name}: {error}')
for key in ('status', 'settled_by'):
    document = json.load(open('axis.json'))
    document['responses'][0]['points'][0][key] = 'fine'
    try:
        jsonschema.validate(document, schema)
    except jsonschema.ValidationError:
        continue
    sys.exit(f'a {key} that does not exist was accepted')
)py");
  const auto python = workshop_.shell("/usr/bin/python3 validate.py " SINERIG_SOURCE_DIR
                                      "/docs/sinerig-sweep.schema.json");
  EXPECT_EQ(python.exit_code, 0) << python.errors;
}

TEST_F(Exchange, CompareTellsByItsExitCode) {
  for (const char* format : {"csv", "mat"}) {
    const std::string name = std::string{"axis."} + format;
    workshop_.sinerig(std::string{"export axis.sweep --channel motor --format "} + format + " -o " +
                      name);
    const auto same = workshop_.sinerig("compare axis.sweep " + name);
    EXPECT_EQ(same.exit_code, 0) << same.errors << same.output;
    EXPECT_THAT(same.output, HasSubstr("same: no change"));
  }
  workshop_.shell("sed 's/^a = .*/a = [[-15.0, -110000.0, 10.0],/' " SINERIG_SOURCE_DIR
                  "/config/two-mass.toml > softer.toml");
  ASSERT_EQ(workshop_.sinerig("run softer.toml --no-report").exit_code, 0);
  const auto changed = workshop_.sinerig("compare axis.sweep softer.sweep -o both.html");
  EXPECT_EQ(changed.exit_code, 5) << changed.output;
  EXPECT_THAT(changed.output, HasSubstr("changed:"));
  EXPECT_THAT(workshop_.read("both.html"), HasSubstr("<title>axis against softer"));
  EXPECT_EQ(workshop_.sinerig("compare axis.sweep").exit_code, 2);
  workshop_.write("far.csv", "0.001,1,0\n");
  const auto nothing = workshop_.sinerig("compare axis.sweep far.csv");
  EXPECT_EQ(nothing.exit_code, 1);
  EXPECT_THAT(nothing.errors, HasSubstr("nothing to compare"));
}

// One of two resonances lies 0.4 Hz lower: that, and what follows from it, is what is said.
TEST_F(Exchange, CompareTellsTheDriftOfResonancesAndMargins) {
  const std::string gimbal = SINERIG_SOURCE_DIR "/config/gimbal.toml";
  workshop_.shell("sed 's/^frequency_hz = 23.0/frequency_hz = 22.6/; s/^seed = 1/seed = 2/' " +
                  gimbal + " > soft.toml");
  workshop_.shell("sed 's/^seed = 1/seed = 3/' " + gimbal + " > again.toml");
  for (const std::string& rig : {gimbal, std::string{"soft.toml"}, std::string{"again.toml"}})
    ASSERT_EQ(workshop_.sinerig("run --quiet --no-report " + rig).exit_code, 0) << rig;

  const auto soft = workshop_.sinerig("compare gimbal.sweep soft.sweep --pid 3,3,0.15,10 --json");
  EXPECT_EQ(soft.exit_code, 5) << soft.errors;
  const auto figures = nlohmann::json::parse(soft.output)["drift"][0]["figures"];
  ASSERT_EQ(figures.size(), 9U);
  EXPECT_EQ(figures[0]["name"], "resonance at 23 Hz");
  EXPECT_NEAR(figures[0]["change"].get<double>(), -0.4, figures[0]["change95"].get<double>());
  EXPECT_TRUE(figures[0]["changed"].get<bool>());
  EXPECT_EQ(figures[2]["name"], "resonance at 90 Hz");
  EXPECT_FALSE(figures[2]["changed"].get<bool>()) << figures[2];
  EXPECT_EQ(figures[5]["name"], "phase margin");

  const auto again = workshop_.sinerig("compare gimbal.sweep again.sweep --drift -o both.html");
  EXPECT_EQ(again.exit_code, 0) << again.output;
  EXPECT_THAT(again.output, HasSubstr("same: no change of the model"));
  EXPECT_THAT(workshop_.read("both.html"), HasSubstr("\"drift\":[{\"name\":\"again\""));
  const auto quiet = workshop_.sinerig("compare gimbal.sweep soft.sweep --quiet --drift");
  EXPECT_EQ(quiet.exit_code, 5);
  EXPECT_EQ(quiet.output + quiet.errors, "");
}

// A full disk behind `>`: no exit code may call that a table.
TEST_F(Exchange, OutputThatIsLostIsAFailure) {
  for (const char* command : {"show axis.sweep", "export axis.sweep",
                              "export axis.sweep "
                              "--format json",
                              "completion bash", "--help", "--version"}) {
    const auto lost = workshop_.sinerig(command + std::string{" >/dev/full"});
    EXPECT_EQ(lost.exit_code, 1) << command;
    EXPECT_THAT(lost.errors, HasSubstr("error: standard output cannot be written")) << command;
  }
  // What went wrong before says more than that.
  EXPECT_EQ(workshop_.sinerig("show none.sweep >/dev/full").exit_code, 1);
  EXPECT_EQ(workshop_.sinerig("export axis.sweep --format mat >/dev/full").exit_code, 2);
  // Whoever reads no further wanted no more.
  EXPECT_EQ(workshop_
                .shell("trap '' PIPE; (" SINERIG_BINARY
                       " export axis.sweep --format json; echo $? >code) | :")
                .errors,
            "");
  EXPECT_EQ(workshop_.read("code"), "0\n");
}

TEST_F(Exchange, UffLeavesOutAResponseWithoutAPointAndSaysSo) {
  workshop_.shell("cp axis.sweep half.sweep");
  const auto clear = [&](const char* channel) {
    record::Database database{(workshop_.folder() / "half.sweep").string(),
                              record::Database::Mode::write};
    database.execute(
        "UPDATE point SET re = NULL, im = NULL WHERE output = (SELECT id FROM channel "
        "WHERE name = '" +
        std::string{channel} + "')");
  };
  clear("motor");
  const auto half = workshop_.sinerig("export half.sweep --format uff -o half.uff");
  EXPECT_EQ(half.exit_code, 0) << half.errors;
  EXPECT_THAT(half.errors, HasSubstr("motor has no point with a response; left out"));
  EXPECT_EQ(workshop_.sinerig("show half.uff").exit_code, 0);
  clear("load");
  const auto none = workshop_.sinerig("export half.sweep --format uff -o none.uff");
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_THAT(none.errors, HasSubstr("no point with a response, nothing to write"));
  EXPECT_FALSE(workshop_.has("none.uff"));
}

// The table `fit` as file-format.md leaves it to other programs: as columns, as one object.
TEST_F(Exchange, ATableOfFitsOfAnotherProgramIsNoObstacle) {
  const char* const tables[] = {
      "CREATE TABLE fit (input INTEGER, output INTEGER, num TEXT NOT NULL, den TEXT NOT NULL, "
      "delay_s REAL, choe TEXT); INSERT INTO fit VALUES (1, 2, '[1]', '[0.01, 1]', 0.001, "
      "'{\"choe\": {\"bands\": \"none\", \"band_models\": 1, \"freq_hz\": [1]}}')",
      "CREATE TABLE fit (input INTEGER, output INTEGER, model TEXT); INSERT INTO fit VALUES (1, 2, "
      "'{\"num\": [1], \"den\": [0.01, 1], \"delay_s\": 0.001}')"};
  for (const char* table : tables) {
    workshop_.shell("cp axis.sweep foreign.sweep");
    const std::string file = (workshop_.folder() / "foreign.sweep").string();
    record::Database{file, record::Database::Mode::write}.execute(table);
    ASSERT_EQ(record::read_sweep(file).fits.size(), 1U);
    const auto fit = workshop_.sinerig("fit foreign.sweep --poles 3 --zeros 2 --delay fit --json");
    EXPECT_EQ(fit.exit_code, 0) << fit.errors;
    const auto fits = record::read_sweep(file).fits;
    ASSERT_EQ(fits.size(), 2U);
    EXPECT_EQ(fits[1].den.size(), 4U);
    EXPECT_EQ(fits[1].label, "ml");
    EXPECT_EQ(fits[0].den, (std::vector<double>{0.01, 1.0}));
    EXPECT_EQ(workshop_.sinerig("report foreign.sweep").exit_code, 0);
    EXPECT_EQ(record::last_fit(file, 1, 2).has_value(), true);
  }
}

TEST_F(Exchange, CommandsTakeFilesMeasuredElsewhere) {
  workshop_.write("other.csv", "freq_hz,re,im,std\n1,1,0,0.01\n10,0.5,-0.5,0.01\n");
  EXPECT_EQ(workshop_.sinerig("report other.csv").exit_code, 0);
  EXPECT_TRUE(workshop_.has("other.html"));
  EXPECT_THAT(workshop_.sinerig("show other.csv").output, HasSubstr("imported"));
  EXPECT_EQ(workshop_.sinerig("export other.csv --format mat").exit_code, 2);
}

// The plant is of third order with delay: what the report draws is the model that was fitted.
TEST_F(Exchange, FitTakesEveryFormatAndTheReportDrawsTheModel) {
  const std::string order = " --poles 3 --zeros 2 --delay fit --json";
  ASSERT_EQ(workshop_.sinerig("fit axis.sweep" + order).exit_code, 0);
  ASSERT_EQ(workshop_.sinerig("report axis.sweep").exit_code, 0);
  EXPECT_THAT(workshop_.read("axis.html"), HasSubstr("\"at_re\":["));
  const record::StoredRun run = record::read_sweep((workshop_.folder() / "axis.sweep").string());
  ASSERT_EQ(run.fits.size(), 1U);
  EXPECT_EQ(run.fits.front().den.size(), 4U);
  EXPECT_DOUBLE_EQ(run.fits.front().hold_period_s, 1.0 / run.plan.rate_hz);
  for (const char* format : {"csv", "mat", "uff"}) {
    const std::string name = std::string{"axis."} + format;
    workshop_.sinerig(std::string{"export axis.sweep --channel motor --format "} + format + " -o " +
                      name);
    const auto fit = workshop_.sinerig("fit " + name + order);
    EXPECT_EQ(fit.exit_code, 0) << fit.errors;
    // The rate of the hold has come along, and H. The weights differ: what an export holds of the
    // scatter is less than what the sweep file does.
    const auto json = nlohmann::json::parse(fit.output);
    EXPECT_DOUBLE_EQ(json["hold_period_s"].get<double>(), 1.0 / run.plan.rate_hz) << format;
    ASSERT_EQ(json["poles"].size(), run.fits.front().poles.size()) << format;
    for (std::size_t i = 0; i < json["poles"].size(); ++i) {
      const std::complex<double> pole{json["poles"][i][0], json["poles"][i][1]};
      const std::complex<double> wanted = run.fits.front().poles[i];
      EXPECT_LE(std::abs(pole - wanted), 1e-3 * std::abs(wanted)) << format << ' ' << i;
    }
  }
}

}  // namespace
}  // namespace sinerig
