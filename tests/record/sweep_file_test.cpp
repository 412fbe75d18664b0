// The sweep file: what is written is what is read, what is there is not overwritten, and what an
// interrupted run leaves can be read.
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <utility>

#include <gmock/gmock.h>
#include <sqlite3.h>

#include "record/point_columns.h"
#include "record/recorder.h"
#include "record/schema.h"
#include "record/stored_point.h"
#include "record/sweep_reader.h"
#include "support/full_disk.h"

namespace sinerig::record {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class SweepFile : public testing::Test {
 protected:
  SweepFile() {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~SweepFile() override { fs::remove_all(folder_); }

  std::string path(const std::string& name = "run.sweep") const { return folder_ / name; }

 private:
  fs::path folder_ =
      fs::path{testing::TempDir()} / testing::UnitTest::GetInstance()->current_test_info()->name();
};

RunInfo an_info() {
  SweepSettings sweep;
  sweep.start_hz = 1.0;
  sweep.stop_hz = 10.0;
  sweep.points = 3;
  sweep.amplitude = 0.5;
  return {.rig_name = "rig.toml",
          .rig_text = "# a rig, with an umlaut: ü\n",
          .clock = "virtual",
          .channels = {{"command", "V"}, {"applied", "V"}, {"gyro", "rad/s"}},
          .plan = plan_sweep(sweep, {}, 1000.0)};
}

Point a_point(std::uint32_t dwell) {
  Point point;
  point.dwell = dwell;
  point.frequency_hz = 1.25 * (dwell + 1);
  point.response = {1.0 / 3.0, -2.0 / 7.0};
  point.covariance = {.re_re = 1e-9, .re_im = -2e-10, .im_im = 3e-9};
  point.input_amplitude = 0.5;
  point.output_amplitude = 0.1;
  return point;
}

std::string refusal_of(const std::string& path) {
  try {
    read_sweep(path);
  } catch (const SweepFileError& error) {
    return error.what();
  }
  return "";
}

void write_and_finish(const std::string& path) {
  SweepWriter writer{path, an_info(), SweepWriter::IfExists::refuse};
  writer.begin_part({});
  writer.end_part("done", "");
  writer.finish();
}

void execute(const std::string& path, const char* sql) {
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &database), SQLITE_OK);
  EXPECT_EQ(sqlite3_exec(database, sql, nullptr, nullptr, nullptr), SQLITE_OK);
  sqlite3_close(database);
}

TEST_F(SweepFile, IsReadBackAsItWasWritten) {
  const RunInfo info = an_info();
  {
    SweepWriter writer{path(), info, SweepWriter::IfExists::refuse};
    writer.write(Event{.kind = EventKind::started});
    writer.write(a_point(1));
    writer.write(a_point(0));
    Point unknown = a_point(2);
    unknown.response = {std::nan(""), std::nan("")};
    unknown.status = PointStatus::rt_fault;
    unknown.reason = PointReason::gaps;
    unknown.reason_value = 3.0;
    writer.write(unknown);
    const ThreadUsage usage{.minor_faults = 5, .major_faults = 1, .involuntary_switches = 4};
    writer.write(
        DwellTiming{.dwell = 0, .first_tick = 7, .ticks = 100, .skipped = 2, .usage = usage});
    writer.write(DwellTiming{.dwell = 1, .first_tick = 107, .ticks = 50});
    const Trip trip{.cause = TripCause::channel_limit, .channel = 0, .value = 3.0, .limit = 2.0};
    writer.write(Event{.kind = EventKind::tripped, .tick = 12, .trip = trip});
    writer.end_part("stopped", "gyro");
    writer.finish();
  }
  const StoredRun run = read_sweep(path());
  EXPECT_EQ(run.fact("rig_text"), info.rig_text);
  EXPECT_EQ(run.fact("rig_name"), "rig.toml");
  EXPECT_EQ(run.fact("clock"), "virtual");
  EXPECT_EQ(run.fact("outcome"), "stopped");
  EXPECT_NE(run.fact("finished_utc"), "");
  EXPECT_EQ(run.fact("nothing"), "");
  ASSERT_EQ(run.channels.size(), 3U);
  EXPECT_EQ(run.channels[2].name, "gyro");
  EXPECT_EQ(run.plan.rate_hz, 1000.0);
  ASSERT_EQ(run.plan.dwells.size(), info.plan.dwells.size());
  for (std::size_t i = 0; i < run.plan.dwells.size(); ++i) {
    EXPECT_EQ(run.plan.dwells[i].asked_hz, info.plan.dwells[i].asked_hz);
    EXPECT_EQ(run.plan.dwells[i].min_samples(), info.plan.dwells[i].min_samples());
    EXPECT_EQ(run.plan.dwells[i].tones.at(0).cycles, info.plan.dwells[i].tones.at(0).cycles);
    EXPECT_EQ(run.plan.dwells[i].tones[0].amplitude, 0.5);
  }
  ASSERT_EQ(run.responses.size(), 1U);
  const auto& points = run.responses[0].points;
  ASSERT_EQ(points.size(), 3U);
  EXPECT_EQ(points[0].frequency_hz, 1.25);  // by rising frequency
  EXPECT_EQ(points[0].response, (std::complex<double>{1.0 / 3.0, -2.0 / 7.0}));
  EXPECT_EQ(points[0].covariance.re_im, -2e-10);
  EXPECT_EQ(points[0].status, "good");
  EXPECT_TRUE(std::isnan(points[2].response.real()));
  EXPECT_EQ(points[2].status, "rt_fault");
  EXPECT_EQ(points[2].reason, "gaps");
  EXPECT_EQ(points[2].reason_value, 3.0);
  ASSERT_EQ(run.timings.size(), 2U);
  EXPECT_EQ(run.timings[0].first_tick, 7U);
  EXPECT_EQ(run.timings[0].skipped, 2U);
  EXPECT_EQ(run.timings[0].usage,
            (ThreadUsage{.minor_faults = 5, .major_faults = 1, .involuntary_switches = 4}));
  EXPECT_EQ(run.timings[1].usage, std::nullopt);
  EXPECT_EQ(run.usage(), run.timings[0].usage);
  ASSERT_EQ(run.events.size(), 2U);
  EXPECT_EQ(run.events[1].kind, "tripped");
  EXPECT_THAT(run.events[1].detail, HasSubstr("gyro = 3 is outside its limit 2"));
}

// Every figure has a value of its own: none may come back as another.
TEST_F(SweepFile, GivesEveryFigureOfAPointBack) {
  const Point written{.dwell = 2,
                      .tone = 3,
                      .pair = 0,
                      .input = 1,
                      .output = 2,
                      .status = PointStatus::distorted,
                      .reason = PointReason::harmonics,
                      .settled_by = SettledBy::both,
                      .reason_value = 6.5,
                      .frequency_hz = 7.5,
                      .response = {8.5, 9.5},
                      .covariance = {.re_re = 10.5, .re_im = 11.5, .im_im = 12.5},
                      .dof = 13.5,
                      .gain_interval_db = 14.5,
                      .phase_interval_deg = 15.5,
                      .input_amplitude = 16.5,
                      .output_amplitude = 17.5,
                      .snr_db = 18.5,
                      .distortion = 19.5,
                      .drift_per_s = 20.5,
                      .samples = 2100.0,
                      .lost = 22.0,
                      .seconds = 23.5};
  {
    SweepWriter writer{path(), an_info(), SweepWriter::IfExists::refuse};
    writer.write(written);
    writer.finish();
  }
  const StoredPoint wanted = stored_point(written, 1000.0);
  const StoredPoint back = read_sweep(path()).responses.at(0).points.at(0);
  EXPECT_EQ(back.dwell, 2U);
  EXPECT_EQ(back.tone, 3U);
  EXPECT_EQ(back.input, 1U);
  EXPECT_EQ(back.output, 2U);
  EXPECT_EQ(back.frequency_hz, 7.5);
  EXPECT_EQ(back.response, (std::complex<double>{8.5, 9.5}));
  EXPECT_EQ(back.covariance.re_re, 10.5);
  EXPECT_EQ(back.covariance.re_im, 11.5);
  EXPECT_EQ(back.covariance.im_im, 12.5);
  EXPECT_EQ(back.dof, 13.5);
  EXPECT_EQ(back.gain_interval_db, 14.5);
  EXPECT_EQ(back.phase_interval_deg, 15.5);
  EXPECT_EQ(back.input_amplitude, 16.5);
  EXPECT_EQ(back.output_amplitude, 17.5);
  EXPECT_EQ(back.snr_db, 18.5);
  EXPECT_EQ(back.distortion, 19.5);
  EXPECT_EQ(back.drift_per_s, 20.5);
  EXPECT_EQ(back.samples, 2100.0);
  EXPECT_EQ(back.lost, 22.0);
  EXPECT_EQ(back.seconds, 23.5);
  EXPECT_EQ(back.reason_value, 6.5);
  EXPECT_EQ(back.status, "distorted");
  EXPECT_EQ(back.reason, "harmonics");
  EXPECT_EQ(back.settled_by, "both");
  EXPECT_TRUE(back.more.empty());
  // A page that is filled while the run goes on shows what the file will.
  for (const PointColumn& column : point_columns)
    EXPECT_EQ(back.*column.value, wanted.*column.value) << column.name;
  EXPECT_EQ(back.status, wanted.status);
  EXPECT_EQ(back.reason, wanted.reason);
  EXPECT_EQ(back.settled_by, wanted.settled_by);
}

// What another process may do at any time, once: before a reader begins with a statement.
class BeforeStatement {
 public:
  BeforeStatement(std::string statement, std::function<void()> action)
      : statement_{std::move(statement)}, action_{std::move(action)} {
    current = this;
    sqlite3_auto_extension(reinterpret_cast<void (*)()>(opened));
  }
  ~BeforeStatement() { sqlite3_cancel_auto_extension(reinterpret_cast<void (*)()>(opened)); }

  bool happened() const { return !action_; }

 private:
  static int opened(sqlite3* database, const char**, const void*) {
    sqlite3_trace_v2(database, SQLITE_TRACE_STMT, begun, current);
    return SQLITE_OK;
  }
  static int begun(unsigned, void* self, void*, void* sql) {
    auto& before = *static_cast<BeforeStatement*>(self);
    const bool awaited =
        std::string{static_cast<const char*>(sql)}.rfind(before.statement_, 0) == 0;
    if (awaited && before.action_) std::exchange(before.action_, {})();
    return 0;
  }

  static inline BeforeStatement* current = nullptr;
  std::string statement_;
  std::function<void()> action_;
};

// The same, before a database is opened.
class BeforeOpening {
 public:
  explicit BeforeOpening(std::function<void()> action) {
    action_ = std::move(action);
    system_ = sqlite3_vfs_find(nullptr);
    files_ = *system_;
    files_.zName = "before_opening";
    files_.xOpen = [](sqlite3_vfs*, const char* name, sqlite3_file* file, int flags, int* used) {
      if (action_) std::exchange(action_, {})();
      return system_->xOpen(system_, name, file, flags, used);
    };
    sqlite3_vfs_register(&files_, 1);
  }
  ~BeforeOpening() {
    sqlite3_vfs_unregister(&files_);
    sqlite3_vfs_register(system_, 1);
  }

  static bool happened() { return !action_; }

 private:
  static inline std::function<void()> action_;
  static inline sqlite3_vfs* system_ = nullptr;
  sqlite3_vfs files_{};
};

TEST_F(SweepFile, IsReadAsItWasAtOneMomentWhileItIsWritten) {
  RunInfo info = an_info();
  info.plan.refinement.candidates = {info.plan.dwells.back()};
  SweepWriter writer{path(), info, SweepWriter::IfExists::refuse};
  writer.begin_part({});
  const BeforeStatement meanwhile{"SELECT dwell, cycles", [&] {
                                    writer.write(Event{.kind = EventKind::refined, .dwell = 3});
                                    writer.commit();
                                  }};
  const StoredRun run = read_sweep(path());
  EXPECT_TRUE(meanwhile.happened());
  EXPECT_EQ(run.plan.dwells.size(), 3U);
  EXPECT_TRUE(run.events.empty());
  EXPECT_EQ(read_sweep(path()).plan.dwells.size(), 4U);
}

TEST_F(SweepFile, ThatIsDamagedSaysWhatIsWrong) {
  write_and_finish(path());
  execute(path(), "INSERT INTO tone VALUES (7, 0, 1, 0.5, 0)");
  EXPECT_EQ(refusal_of(path()), path() + ": is damaged: a tone of dwell 7, which it does not have");
  execute(path(), "DELETE FROM tone; INSERT INTO event VALUES (NULL, 0, 0, 'gap', 9, '', 0, '')");
  EXPECT_EQ(refusal_of(path()),
            path() + ": is damaged: an event of channel 9, which it does not have");
}

// Of two that find the name free at the same moment one has it, whatever the other does.
TEST_F(SweepFile, IsThatOfOneOfTwoWhoWantTheSameName) {
  int written = 0;
  int refused = 0;
  const auto write = [&] {
    try {
      write_and_finish(path());
      ++written;
    } catch (const SweepFileError&) {
      ++refused;
    }
  };
  const BeforeOpening meanwhile{write};
  write();
  EXPECT_TRUE(meanwhile.happened());
  EXPECT_EQ(written, 1);
  EXPECT_EQ(refused, 1);
  EXPECT_EQ(read_sweep(path()).fact("outcome"), "done");
}

TEST_F(SweepFile, IsClaimedByOne) {
  const auto mine = FileLock::claim(path());
  ASSERT_NE(mine, nullptr);
  EXPECT_EQ(FileLock::claim(path()), nullptr);
  write_and_finish(path("finished.sweep"));
  EXPECT_EQ(FileLock::claim(path("finished.sweep")), nullptr);
  EXPECT_THROW((FileLock{path(), "in use"}), FileInUse);
}

TEST_F(SweepFile, FromBeforeTheThreadsUsageWasKeptIsReadWithoutIt) {
  {
    SweepWriter writer{path(), an_info(), SweepWriter::IfExists::refuse};
    writer.write(DwellTiming{.dwell = 0, .ticks = 100, .usage = ThreadUsage{.minor_faults = 5}});
    writer.finish();
  }
  EXPECT_TRUE(read_sweep(path()).usage());
  execute(path(),
          "CREATE TABLE old AS SELECT dwell, first_tick, ticks, skipped, resettles, "
          "max_lateness_ns, lateness_us FROM timing; DROP TABLE timing; ALTER TABLE old RENAME TO "
          "timing");
  const StoredRun run = read_sweep(path());
  ASSERT_EQ(run.timings.size(), 1U);
  EXPECT_EQ(run.timings[0].ticks, 100U);
  EXPECT_EQ(run.usage(), std::nullopt);
}

TEST_F(SweepFile, IsOnePlainFileOnceItIsFinished) {
  write_and_finish(path());
  EXPECT_TRUE(fs::exists(path()));
  EXPECT_FALSE(fs::exists(path() + "-wal"));
  EXPECT_FALSE(fs::exists(path() + "-shm"));
}

TEST_F(SweepFile, IsNotOverwrittenUnlessTold) {
  write_and_finish(path());
  try {
    SweepWriter{path(), an_info(), SweepWriter::IfExists::refuse};
    FAIL();
  } catch (const FileExists& error) {
    EXPECT_EQ(error.what(),
              path() + ": exists already; choose another name with -o, or --force to replace it");
  }
  SweepWriter writer{path(), an_info(), SweepWriter::IfExists::replace};
  writer.set("outcome", "again");
  writer.finish();
  EXPECT_EQ(read_sweep(path()).fact("outcome"), "again");
}

// What a killed run leaves: its last points are in the log beside the file.
class ReplacedFile : public SweepFile {
 protected:
  ReplacedFile() {
    SweepWriter writer{path("whole.sweep"), an_info(), SweepWriter::IfExists::refuse};
    writer.write(a_point(0));
    writer.write(DwellTiming{.dwell = 0});
    for (const char* suffix : {"", "-wal"}) {
      fs::copy_file(path("whole.sweep") + suffix, path() + suffix);
    }
  }
  std::size_t points() const {
    const StoredRun run = read_sweep(path());
    return run.responses.empty() ? 0 : run.responses[0].points.size();
  }
};

TEST_F(ReplacedFile, IsBackWhereTheNewRunNeverBegins) {
  SweepWriter writer{path(), an_info(), SweepWriter::IfExists::replace};
  EXPECT_EQ(points(), 0U);
  writer.discard();
  EXPECT_FALSE(fs::exists(path() + "-old"));
  EXPECT_FALSE(fs::exists(path() + "-old-wal"));
  EXPECT_EQ(points(), 1U);
}

// Two files cannot be renamed at one stroke: a kill in between would leave the points of the log
// with neither name.
TEST_F(ReplacedFile, IsOneFileBeforeItIsSetAside) {
  const SweepWriter writer{path(), an_info(), SweepWriter::IfExists::replace};
  EXPECT_FALSE(fs::exists(path() + "-old-wal"));
  EXPECT_EQ(read_sweep(path() + "-old").responses.at(0).points.size(), 1U);
}

TEST_F(ReplacedFile, IsGoneWhenTheNewRunBegins) {
  SweepWriter writer{path(), an_info(), SweepWriter::IfExists::replace};
  EXPECT_TRUE(fs::exists(path() + "-old"));
  writer.begin_part({});
  EXPECT_FALSE(fs::exists(path() + "-old"));
  EXPECT_FALSE(fs::exists(path() + "-old-wal"));
  EXPECT_EQ(points(), 0U);
}

TEST_F(ReplacedFile, OutlivesANewRunThatIsKilledBeforeItBegins) {
  { const SweepWriter killed{path(), an_info(), SweepWriter::IfExists::replace}; }
  EXPECT_TRUE(fs::exists(path() + "-old"));
  SweepWriter writer{path(), an_info(), SweepWriter::IfExists::replace};
  EXPECT_TRUE(fs::exists(path() + "-old"));
  writer.discard();
  EXPECT_EQ(points(), 1U);
}

TEST_F(SweepFile, OfARunThatWasKilledHoldsEveryFinishedDwell) {
  SweepWriter writer{path(), an_info(), SweepWriter::IfExists::refuse};
  writer.write(a_point(0));
  writer.write(DwellTiming{.dwell = 0});
  writer.write(a_point(1));  // its dwell is still running
  // What a power cut would leave: the files as they are on the disk now.
  for (const char* suffix : {"", "-wal"}) {
    fs::copy_file(path() + suffix, path("left.sweep") + suffix);
  }
  const StoredRun run = read_sweep(path("left.sweep"));
  ASSERT_EQ(run.responses.size(), 1U);
  EXPECT_EQ(run.responses[0].points.size(), 1U);
  EXPECT_EQ(run.fact("outcome"), "");
  EXPECT_EQ(run.fact("rig_text"), an_info().rig_text);
}

TEST_F(SweepFile, IsLeftNowhereWhenItIsDiscarded) {
  SweepWriter writer{path(), an_info(), SweepWriter::IfExists::refuse};
  writer.discard();
  EXPECT_FALSE(fs::exists(path()));
  EXPECT_FALSE(fs::exists(path() + "-wal"));
}

TEST_F(SweepFile, CarriesItsIdentityAndVersion) {
  write_and_finish(path());
  Database database{path(), Database::Mode::read};
  EXPECT_EQ(database.pragma("application_id"), application_id);
  EXPECT_EQ(database.pragma("user_version"), schema_version);
}

TEST_F(SweepFile, IsRefusedWhenItIsSomethingElse) {
  EXPECT_EQ(refusal_of(path("none")), path("none") + ": does not exist");
  std::ofstream{path("text")} << "freq_hz,re,im\n" << std::string(2000, 'x');
  EXPECT_THAT(refusal_of(path("text")), HasSubstr("file is not a database"));
  execute(path("other"), "CREATE TABLE a (b); PRAGMA application_id = 7;");
  EXPECT_EQ(refusal_of(path("other")), path("other") + ": is not a sweep file");
  std::ofstream{path("empty")};
  EXPECT_EQ(refusal_of(path("empty")), path("empty") + ": is not a sweep file");
}

TEST_F(SweepFile, OfANewerVersionIsRefused) {
  write_and_finish(path());
  execute(path(), "PRAGMA user_version = 99;");
  EXPECT_EQ(refusal_of(path()),
            path() + ": was written by a newer sinerig (file version 99, this one reads up to " +
                std::to_string(schema_version) + ")");
}

TEST_F(SweepFile, ThatCannotBeCreatedSaysWhy) {
  try {
    SweepWriter{path("no/such/folder.sweep"), an_info(), SweepWriter::IfExists::refuse};
    FAIL();
  } catch (const SweepFileError& error) {
    EXPECT_THAT(error.what(), HasSubstr("cannot be created: No such file or directory"));
  }
}

TEST_F(SweepFile, OnAFullDiskStopsTheLoopAndSaysSo) {
  Outbox outbox{1 << 10, 1 << 10, Outbox::WhenFull::wait};
  SweepWriter writer{path(), an_info(), SweepWriter::IfExists::refuse};
  Recorder recorder{outbox, writer, {}};
  const test::FullDisk full{fs::file_size(path() + "-wal") + 4096};
  std::uint64_t put = 0;
  while (outbox.flush() && put < 1'000'000) {
    outbox.put(Event{.kind = EventKind::gap, .tick = put++});
    if (put % 100 == 0) outbox.put(DwellTiming{.dwell = static_cast<std::uint32_t>(put)});
  }
  EXPECT_LT(put, 1'000'000U);
  outbox.close();
  try {
    recorder.finish();
    FAIL();
  } catch (const SweepFileError& error) {
    EXPECT_THAT(error.what(), HasSubstr(path() + ": "));
  }
}

// As a user takes the name away, and which file then stands under it.
struct Displacement {
  const char* name;
  void (*take_away)(const std::string& path);
  const char* left;  // under the name
};

class DisplacedFile : public SweepFile, public testing::WithParamInterface<Displacement> {
 protected:
  static std::string left(const std::string& path) {
    std::ifstream stream{path};
    return {std::istreambuf_iterator<char>{stream}, {}};
  }
};

TEST_P(DisplacedFile, IsNoticedAtTheNextPointAndKeptUnderAnotherName) {
  SweepWriter writer{path(), an_info(), SweepWriter::IfExists::refuse};
  writer.begin_part({});
  writer.write(a_point(0));
  writer.write(DwellTiming{.dwell = 0, .ticks = 100});
  GetParam().take_away(path());
  writer.write(a_point(1));
  try {
    writer.write(DwellTiming{.dwell = 1, .first_tick = 100, .ticks = 100});
    FAIL() << "the run goes on";
  } catch (const SweepFileError& error) {
    EXPECT_THAT(error.what(), HasSubstr("run.sweep: was removed, renamed or replaced"));
  }
  EXPECT_TRUE(writer.rescue());
  writer.end_part("stopped", "no file");
  try {
    writer.finish();
    FAIL() << "nobody is told where the points are";
  } catch (const SweepFileError& error) {
    EXPECT_THAT(error.what(), HasSubstr("run.sweep-rescued: holds what was measured"));
  }
  EXPECT_EQ(writer.path(), path("run.sweep-rescued"));
  const StoredRun kept = read_sweep(writer.path());
  EXPECT_EQ(kept.responses.at(0).points.size(), 2U);
  EXPECT_EQ(kept.fact("outcome"), "stopped");
  EXPECT_EQ(left(path()), GetParam().left);
}

TEST_P(DisplacedFile, IsNoticedAtTheVeryEnd) {
  SweepWriter writer{path(), an_info(), SweepWriter::IfExists::refuse};
  writer.begin_part({});
  writer.end_part("done", "");
  GetParam().take_away(path());
  EXPECT_THROW(writer.finish(), SweepFileError);
  EXPECT_EQ(read_sweep(path("run.sweep-rescued")).fact("outcome"), "done");
}

TEST_P(DisplacedFile, IsLeftToWhoeverTookTheNameWhereTheRunNeverBegins) {
  SweepWriter writer{path(), an_info(), SweepWriter::IfExists::refuse};
  GetParam().take_away(path());
  EXPECT_THROW(writer.begin_part({}), SweepFileError);
  writer.discard();
  EXPECT_EQ(left(path()), GetParam().left);
}

INSTANTIATE_TEST_SUITE_P(
    Ways, DisplacedFile,
    testing::Values(Displacement{"removed", [](const std::string& path) { fs::remove(path); }, ""},
                    Displacement{"renamed",
                                 [](const std::string& path) { fs::rename(path, path + "-kept"); },
                                 ""},
                    Displacement{"replaced",
                                 [](const std::string& path) {
                                   std::ofstream{path + ".new"} << "another";
                                   fs::rename(path + ".new", path);
                                 },
                                 "another"}),
    [](const auto& each) { return each.param.name; });

TEST_F(SweepFile, IsWrittenByAThreadBesideTheLoop) {
  Outbox outbox{64, 1 << 12, Outbox::WhenFull::wait};
  SweepWriter writer{path(), an_info(), SweepWriter::IfExists::refuse};
  std::uint64_t seen = 0;
  {
    Recorder recorder{outbox, writer, [&](const Record&) {
                        ++seen;
                      }};
    for (std::uint64_t tick = 0; tick < 2000; ++tick) {
      outbox.put_sample({.tick = tick, .channels = 3, .values = {1.0, 2.0, 3.0}});
    }
    outbox.put(a_point(0));
    outbox.put(DwellTiming{.dwell = 0});
    outbox.close();
    recorder.finish();
  }
  writer.finish();
  EXPECT_EQ(seen, 2002U);
  EXPECT_EQ(read_sweep(path()).responses.at(0).points.size(), 1U);
  Database database{path(), Database::Mode::read};
  Statement count{database, "SELECT count(*) FROM sample"};
  ASSERT_TRUE(count.step());
  EXPECT_EQ(count.integer(0), 6000);
}

TEST(UnwrappedPhase, TakesOutWholeTurnsAndStepsOverMissingPoints) {
  std::vector<StoredPoint> points(8);
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].response = std::polar(1.0, -0.9 * static_cast<double>(i));
  }
  points[3].response = {std::nan(""), std::nan("")};
  const auto phase = unwrapped_phase(points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i != 3) {
      EXPECT_NEAR(phase[i], -0.9 * static_cast<double>(i), 1e-12);
    }
  }
  EXPECT_TRUE(std::isnan(phase[3]));
}

}  // namespace
}  // namespace sinerig::record
