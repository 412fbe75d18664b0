// The file of a run in several parts: nothing finished changes, what was interrupted is repeated.
#include <cmath>
#include <filesystem>

#include <gmock/gmock.h>
#include <sqlite3.h>

#include "record/recorder.h"
#include "record/schema.h"
#include "record/sweep_path.h"
#include "record/unfinished_run.h"

namespace sinerig::record {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

RunInfo an_info() {
  SweepSettings sweep;
  sweep.start_hz = 1.0;
  sweep.stop_hz = 10.0;
  sweep.points = 4;
  sweep.amplitude = 0.5;
  return {.rig_name = "rig.toml",
          .rig_text = "# a rig\n",
          .clock = "virtual",
          .channels = {{"command", "V"}, {"applied", "V"}, {"gyro", "rad/s"}},
          .plan = plan_sweep(sweep, {}, 1000.0)};
}

Point a_point(std::uint32_t dwell, PointStatus status = PointStatus::good,
              PointReason reason = PointReason::none) {
  Point point;
  point.reason = reason;
  point.dwell = dwell;
  point.frequency_hz = 1.25 * (dwell + 1);
  point.response = {1.0 / (dwell + 3.0), -2.0 / 7.0};
  point.status = status;
  return point;
}

class ResumedFile : public testing::Test {
 protected:
  ResumedFile() {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~ResumedFile() override { fs::remove_all(folder_); }

  std::string path() const { return folder_ / "run.sweep"; }

  void dwell(SweepWriter& writer, std::uint32_t id, std::uint64_t first_tick,
             PointStatus status = PointStatus::good, PointReason reason = PointReason::none) {
    writer.write(Block{.dwell = id, .channel = 2, .first_tick = first_tick + 10});
    writer.write(Lesson{.dwell = id, .response = {1.0, 2.0}, .white = 1e-9, .scatter_dof = 6.0});
    writer.write(a_point(id, status, reason));
    writer.write(DwellTiming{.dwell = id, .first_tick = first_tick, .ticks = 5000});
  }

  // Two dwells, then stopped in the third.
  void first_part() {
    SweepWriter writer{path(), an_info(), SweepWriter::IfExists::refuse};
    writer.begin_part({});
    dwell(writer, 0, 0);
    dwell(writer, 1, 5000);
    dwell(writer, 2, 10000, PointStatus::stopped);
    writer.end_part("interrupted", "stop requested");
    writer.finish();
  }
  std::vector<std::string> texts(const std::string& query) const {
    Database database{path(), Database::Mode::read};
    Statement rows{database, query};
    std::vector<std::string> all;
    while (rows.step()) all.push_back(rows.text(0));
    return all;
  }

  fs::path folder_ =
      fs::path{testing::TempDir()} /
      (std::string{"resumed-"} + testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(ResumedFile, GoesOnWithTheDwellThatWasStopped) {
  first_part();
  const UnfinishedRun run = read_unfinished(path());
  EXPECT_FALSE(run.done());
  EXPECT_EQ(run.finished.dwells, 2U);
  EXPECT_EQ(run.stored.plan.dwells.size(), 4U);
  ASSERT_EQ(run.finished.points.size(), 2U);
  EXPECT_EQ(run.finished.points[1].response, a_point(1).response);
  EXPECT_EQ(run.finished.lessons.size(), 3U);
  EXPECT_EQ(run.start.dwell, 2U);
  EXPECT_GE(run.start.tick, 15000U);
}

// All dwells were finished; two were condemned, and one of them has been measured again.
TEST_F(ResumedFile, KnowsWhatIsStillToBeMeasuredAgain) {
  {
    SweepWriter writer{path(), an_info(), SweepWriter::IfExists::refuse};
    writer.begin_part({});
    for (std::uint32_t id = 0; id < 4; ++id) dwell(writer, id, 5000 * id);
    for (const std::uint32_t id : {1U, 2U, 3U})
      writer.write(Event{.kind = EventKind::condemned, .dwell = id, .tick = 20000});
    writer.write(Event{.kind = EventKind::remeasured, .dwell = 1, .tick = 20001});
    dwell(writer, 1, 20001);
    writer.write(Event{.kind = EventKind::remeasured, .dwell = 2, .tick = 25001});
    dwell(writer, 2, 25001, PointStatus::stopped);
    writer.end_part("interrupted", "stop requested");
    writer.finish();
  }
  const UnfinishedRun run = read_unfinished(path());
  EXPECT_FALSE(run.done());
  EXPECT_EQ(run.finished.dwells, 4U);
  EXPECT_EQ(run.finished.condemned, (std::vector<std::uint32_t>{2, 3}));
}

// Killed, or stopped, while the modes were looked for once more.
TEST_F(ResumedFile, CondemnsWhatWasDoubtedAndNotJudged) {
  const auto condemned = [&] {
    return read_unfinished(path()).finished.condemned;
  };
  const auto doubt = [](std::uint32_t id, std::uint64_t tick, double value) {
    return Event{.kind = EventKind::model_doubted, .dwell = id, .tick = tick, .value = value};
  };
  const auto modelled_dwell = [&](SweepWriter& writer, std::uint32_t id, std::uint64_t first_tick) {
    Point point = a_point(id);
    point.settled_by = SettledBy::model;
    writer.write(point);
    writer.write(DwellTiming{.dwell = id, .first_tick = first_tick, .ticks = 5000});
  };
  {
    SweepWriter first{path(), an_info(), SweepWriter::IfExists::refuse};
    first.begin_part({});
    first.write(Event{.kind = EventKind::started});
    modelled_dwell(first, 0, 0);
    dwell(first, 1, 5000);
    first.write(doubt(1, 9999, doubt_begins));
    first.commit();
    EXPECT_EQ(condemned(), std::vector<std::uint32_t>{0});
    first.write(doubt(1, 11000, 0.0));  // the modes are confirmed
    first.commit();
    EXPECT_TRUE(condemned().empty());
    first.write(doubt(1, 11001, doubt_begins));
    first.end_part("interrupted", "stop requested");
    first.finish();
  }
  const std::vector<std::uint32_t> doubted = condemned();
  EXPECT_EQ(doubted, std::vector<std::uint32_t>{0});

  // What another part finds of its own modes is no verdict on those.
  SweepWriter second{path(), an_info()};
  second.begin_part(read_unfinished(path()).start);
  second.write(doubt(2, 0, not_reviewed));
  second.write(Event{.kind = EventKind::started});
  modelled_dwell(second, 2, 100);
  second.write(doubt(2, 5100, doubt_begins));
  second.write(doubt(2, 5200, 0.0));
  second.commit();
  EXPECT_EQ(condemned(), doubted);
  second.write(Event{.kind = EventKind::remeasured, .dwell = 0, .tick = 6000});
  dwell(second, 0, 6000);
  EXPECT_TRUE(condemned().empty());
}

TEST_F(ResumedFile, KeepsWhatWasFinishedAndReplacesTheStoppedPoint) {
  first_part();
  const auto before = texts("SELECT quote(re) || quote(im) FROM point WHERE dwell < 2");
  const UnfinishedRun run = read_unfinished(path());
  {
    SweepWriter writer{path(), an_info()};
    writer.begin_part(run.start);
    dwell(writer, 2, 0);
    dwell(writer, 3, 5000);
    writer.end_part("done", "");
    writer.finish();
  }
  EXPECT_EQ(texts("SELECT quote(re) || quote(im) FROM point WHERE dwell < 2"), before);
  EXPECT_EQ(texts("SELECT status FROM point"), (std::vector<std::string>(4, "good")));
  EXPECT_EQ(texts("SELECT attempt FROM block WHERE dwell = 2"),
            (std::vector<std::string>{"0", "1"}));
  const StoredRun stored = read_sweep(path());
  ASSERT_EQ(stored.parts.size(), 2U);
  EXPECT_EQ(stored.parts[0].outcome, "interrupted");
  EXPECT_EQ(stored.parts[0].detail, "stop requested");
  EXPECT_EQ(stored.parts[1].outcome, "done");
  EXPECT_EQ(stored.parts[1].first_dwell, 2U);
  // Ticks count on: no two of them are the same.
  EXPECT_EQ(stored.parts[1].first_tick, run.start.tick);
  EXPECT_EQ(stored.timings.at(2).first_tick, run.start.tick);
  EXPECT_EQ(stored.timings.at(3).first_tick, run.start.tick + 5000);
  EXPECT_EQ(stored.fact("outcome"), "done");
  EXPECT_TRUE(read_unfinished(path()).done());
  EXPECT_FALSE(can_be_resumed(path()));
}

// The sweep went on behind dwell 1 and was killed in dwell 3.
TEST_F(ResumedFile, LeavesThePointThatASoftLimitGaveUp) {
  {
    SweepWriter writer{path(), an_info(), SweepWriter::IfExists::refuse};
    writer.begin_part({});
    dwell(writer, 0, 0);
    // A device's fault had passed before.
    writer.write(Event{.kind = EventKind::tripped, .dwell = 1, .tick = 6000});
    writer.write(Event{.kind = EventKind::limited, .dwell = 1, .tick = 7000});
    dwell(writer, 1, 5000, PointStatus::stopped, PointReason::soft_limit);
    dwell(writer, 2, 10000);
    writer.write(Block{.dwell = 3, .channel = 2, .first_tick = 15010});
    writer.commit();
  }
  const UnfinishedRun run = read_unfinished(path());
  EXPECT_EQ(run.finished.dwells, 3U);
  ASSERT_EQ(run.finished.points.size(), 3U);
  EXPECT_EQ(run.finished.points[1].status, PointStatus::stopped);
  EXPECT_EQ(run.finished.points[1].reason, PointReason::soft_limit);
  EXPECT_EQ(run.start.dwell, 3U);
}

// Its tries in all were spent: the sweep has to go on with this very dwell.
TEST_F(ResumedFile, RepeatsTheDwellInWhichASoftLimitEndedTheSweep) {
  {
    SweepWriter writer{path(), an_info(), SweepWriter::IfExists::refuse};
    writer.begin_part({});
    dwell(writer, 0, 0);
    writer.write(Event{.kind = EventKind::limited, .dwell = 1, .tick = 7000});
    dwell(writer, 1, 5000, PointStatus::stopped, PointReason::soft_limit);
    writer.write(Event{.kind = EventKind::tripped, .dwell = 1, .tick = 7000});
    writer.end_part("stopped", "y is outside its soft limit");
    writer.finish();
  }
  EXPECT_EQ(read_unfinished(path()).finished.dwells, 1U);
}

TEST_F(ResumedFile, HasRoomForAnotherAttemptAtEveryDwell) {
  {
    SweepWriter writer{path(), an_info(), SweepWriter::IfExists::refuse};
    writer.begin_part({});
    for (std::uint32_t id = 0; id < 4; ++id) dwell(writer, id, 5000 * id);
  }
  SweepWriter writer{path(), an_info()};
  writer.begin_part({.dwell = 1, .tick = 20000});
  for (std::uint32_t id = 1; id < 4; ++id) dwell(writer, id, 5000 * id);
  writer.finish();
  EXPECT_EQ(texts("SELECT dwell || ':' || attempt FROM block"),
            (std::vector<std::string>{"0:0", "1:0", "1:1", "2:0", "2:1", "3:0", "3:1"}));
}

// Whatever value an enumeration has, the last one included, comes back as itself.
TEST_F(ResumedFile, KnowsEveryWordOfAPoint) {
  std::vector<Point> points;
  {
    SweepWriter writer{path(), an_info(), SweepWriter::IfExists::refuse};
    writer.begin_part({});
    const std::string none = to_string(static_cast<PointReason>(UINT8_MAX));
    std::uint8_t value = 0;
    for (; to_string(static_cast<PointReason>(value)) != none; ++value) {
      Point point = a_point(0);
      point.tone = value;
      point.reason = static_cast<PointReason>(value);
      point.status = static_cast<PointStatus>(std::min<int>(value, 5));
      point.settled_by = static_cast<SettledBy>(std::min<int>(value, 4));
      points.push_back(point);
      writer.write(point);
    }
    ASSERT_GT(value, 12);
    writer.write(DwellTiming{.dwell = 0});
  }
  const std::vector<Point> back = read_unfinished(path()).finished.points;
  ASSERT_EQ(back.size(), points.size());
  for (std::size_t i = 0; i < back.size(); ++i) {
    EXPECT_EQ(back[i].reason, points[i].reason);
    EXPECT_EQ(back[i].status, points[i].status);
    EXPECT_EQ(back[i].settled_by, points[i].settled_by);
  }
  Database{path(), Database::Mode::write}.execute("UPDATE point SET reason = 'of_tomorrow'");
  try {
    read_unfinished(path());
    FAIL();
  } catch (const SweepFileError& error) {
    EXPECT_THAT(error.what(), HasSubstr(path() + ": was begun by another version of sinerig"));
    EXPECT_THAT(error.what(), HasSubstr("`of_tomorrow`"));
  }
}

TEST_F(ResumedFile, CallsAPartWithoutAnEndKilled) {
  {
    SweepWriter writer{path(), an_info(), SweepWriter::IfExists::refuse};
    writer.begin_part({});
    dwell(writer, 0, 0);
  }
  EXPECT_EQ(read_sweep(path()).parts.at(0).outcome, "");
  const UnfinishedRun run = read_unfinished(path());
  SweepWriter writer{path(), an_info()};
  writer.begin_part(run.start);
  const StoredRun stored = read_sweep(path());
  ASSERT_EQ(stored.parts.size(), 2U);
  EXPECT_EQ(stored.parts[0].outcome, "killed");
  EXPECT_EQ(stored.parts[0].finished_utc, "");
  EXPECT_EQ(stored.parts[1].outcome, "");
  EXPECT_EQ(stored.fact("outcome"), "");
}

TEST_F(ResumedFile, StaysAsItIsWhenThePartNeverBegins) {
  first_part();
  const auto facts = texts("SELECT key || value FROM run");
  {
    SweepWriter writer{path(), an_info()};
    writer.discard();
  }
  EXPECT_EQ(texts("SELECT key || value FROM run"), facts);
  EXPECT_EQ(read_sweep(path()).parts.size(), 1U);
}

TEST_F(ResumedFile, HasOneWriterAtATime) {
  SweepWriter writer{path(), an_info(), SweepWriter::IfExists::refuse};
  const std::string in_use = path() + ": is being written by a sinerig that still runs";
  const auto refusal = [](const auto& open) -> std::string {
    try {
      open();
    } catch (const FileInUse& error) {
      return error.what();
    }
    return "none";
  };
  EXPECT_THAT(refusal([&] { const SweepWriter second(path(), an_info()); }), HasSubstr(in_use));
  EXPECT_THAT(refusal([&] { claim_path(path(), true); }), HasSubstr(in_use));
  EXPECT_THAT(refusal([&] { claim_path(path(), false); }), HasSubstr(in_use));
  writer.begin_part({});
  dwell(writer, 0, 0);
  EXPECT_EQ(read_sweep(path()).responses.at(0).points.size(), 1U) << "readers are not locked out";
}

TEST_F(ResumedFile, IsNamedWhenANewRunWouldTakeItsPlace) {
  first_part();
  try {
    claim_path(path(), false);
    FAIL();
  } catch (const FileExists& error) {
    EXPECT_EQ(error.what(), path() +
                                ": exists already, and its run was interrupted: `sinerig "
                                "resume " +
                                path() +
                                "` goes on with it; choose another name "
                                "with -o, or --force to replace it");
  }
}

TEST_F(ResumedFile, OfAnotherPlanIsRefused) {
  first_part();
  const SweepPlan stored = read_unfinished(path()).stored.plan;
  EXPECT_TRUE(candidates_refined(path(), stored, an_info().plan).empty());
  SweepPlan other = an_info().plan;
  other.dwells[1].tones[0].amplitude *= 1.0 + 1e-15;
  try {
    candidates_refined(path(), stored, other);
    FAIL();
  } catch (const SweepFileError& error) {
    EXPECT_EQ(error.what(), path() +
                                ": this sinerig plans dwell 2 of its rig file differently than "
                                "the one that began the run; resume it with that version");
  }
  other = an_info().plan;
  other.dwells.push_back(other.dwells.back());
  EXPECT_THROW(candidates_refined(path(), stored, other), SweepFileError);
  // What has been added is a candidate of the plan, or another version's.
  other = an_info().plan;
  const Dwell last = other.dwells.back();
  other.dwells.pop_back();
  EXPECT_THROW(candidates_refined(path(), stored, other), SweepFileError);
  other.refinement.candidates = {other.dwells.front(), last};
  other.refinement.most_points = 1;
  EXPECT_EQ(candidates_refined(path(), stored, other), std::vector<std::uint32_t>{1});
}

TEST_F(ResumedFile, OfAnotherLayoutIsReadButNotResumed) {
  first_part();
  {
    Database database{path(), Database::Mode::write};
    database.execute("DROP TABLE part; DROP TABLE lesson; DROP TABLE durability");
  }
  const StoredRun stored = read_sweep(path());  // a file of before there were parts
  EXPECT_TRUE(stored.parts.empty());
  EXPECT_TRUE(stored.lag_s.empty());
  EXPECT_EQ(stored.responses.at(0).points.size(), 3U);
  try {
    read_unfinished(path());
    FAIL();
  } catch (const SweepFileError& error) {
    EXPECT_THAT(error.what(), HasSubstr("was begun by another version of sinerig, whose table "
                                        "`durability` is not this one's"));
  }
}

TEST_F(ResumedFile, NeverHoldsAPartOfADwellsPoints) {
  SweepWriter writer{path(), an_info(), SweepWriter::IfExists::refuse};
  writer.begin_part({});
  writer.write(a_point(0));
  writer.commit();  // the interval of events and samples has passed
  EXPECT_TRUE(read_sweep(path()).responses.empty());
  writer.write(DwellTiming{.dwell = 0});
  EXPECT_EQ(read_sweep(path()).responses.at(0).points.size(), 1U);
}

TEST_F(ResumedFile, ToldPointsAreOnTheDisk) {
  Outbox outbox{64, 64, Outbox::WhenFull::wait};
  SweepWriter writer{path(), an_info(), SweepWriter::IfExists::refuse};
  writer.begin_part({});
  std::size_t on_disk = 0;
  const auto observe = [&](const Record& record) {
    if (!std::holds_alternative<Point>(record)) return;
    const StoredRun stored = read_sweep(path());
    on_disk += stored.responses.at(0).points.size();
  };
  Recorder recorder{outbox, writer, observe};
  for (std::uint32_t id = 0; id < 3; ++id) {
    outbox.put(a_point(id));
    outbox.put(DwellTiming{.dwell = id});
    // In virtual time the loop has waited for that.
    EXPECT_EQ(read_sweep(path()).responses.at(0).points.size(), id + 1U);
  }
  outbox.close();
  recorder.finish();
  EXPECT_EQ(on_disk, 1U + 2U + 3U);
}

TEST_F(ResumedFile, KeepsHowFarTheDiskIsBehind) {
  Outbox outbox{64, 64, Outbox::WhenFull::keep};
  SweepWriter writer{path(), an_info(), SweepWriter::IfExists::refuse};
  writer.begin_part({});
  outbox.put(DwellTiming{.dwell = 0});
  for (int tick = 0; tick < 250; ++tick) outbox.flush();
  Recorder recorder{outbox, writer, {}, Recorder::Samples::written, 0.001};
  outbox.close();
  recorder.finish();
  writer.finish();
  EXPECT_NEAR(read_sweep(path()).lag_s.at(0), 0.25, 1e-12);
}

TEST_F(ResumedFile, HoldsRoomBackWhileItIsWritten) {
  {
    SweepWriter writer{path(), an_info(), SweepWriter::IfExists::refuse};
    EXPECT_EQ(fs::file_size(path() + "-spare"), SpareRoom::bytes);
  }
  EXPECT_FALSE(fs::exists(path() + "-spare"));
  try {
    const SpareRoom nowhere{(folder_ / "no" / "such.sweep").string()};
    FAIL();
  } catch (const SweepFileError& error) {
    EXPECT_THAT(error.what(), HasSubstr("such.sweep-spare: cannot be created: No such file"));
  }
}

TEST(AnOutbox, StopsTheLoopWhenTheDiskIsTooLate) {
  Outbox outbox{64, 64, Outbox::WhenFull::keep, 100};
  for (int tick = 0; tick < 1000; ++tick) ASSERT_TRUE(outbox.flush());
  outbox.put(DwellTiming{});
  for (int tick = 0; tick < 100; ++tick) ASSERT_TRUE(outbox.flush());
  EXPECT_EQ(outbox.acknowledge(), 100U);
  outbox.put(DwellTiming{});
  for (int tick = 0; tick < 100; ++tick) ASSERT_TRUE(outbox.flush());
  EXPECT_FALSE(outbox.overdue());
  EXPECT_FALSE(outbox.flush());
  EXPECT_TRUE(outbox.overdue());
}

}  // namespace
}  // namespace sinerig::record
