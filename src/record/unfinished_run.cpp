#include "record/unfinished_run.h"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include "record/schema.h"

namespace sinerig::record {

namespace {

using Tables = std::map<std::string, std::string>;  // SQL by name

Tables tables_of(Database& database) {
  Tables tables;
  Statement rows{database, "SELECT name, sql FROM sqlite_master WHERE type = 'table'"};
  while (rows.step()) tables.emplace(rows.text(0), rows.text(1));
  return tables;
}

void refuse_not_begun(const std::string& path) {
  if (is_begun(path)) return;
  throw SweepFileError(path +
                       ": is not a sweep file, or one whose run was killed before it began: "
                       "there is nothing to resume");
}

void refuse_other_layout(const std::string& path, Database& database) {
  Database fresh{":memory:", Database::Mode::create};
  fresh.execute(schema_sql);
  const Tables stored = tables_of(database);
  for (const auto& [name, sql] : tables_of(fresh)) {
    const auto found = stored.find(name);
    if (found != stored.end() && found->second == sql) continue;
    throw SweepFileError(path + ": was begun by another version of sinerig, whose table `" + name +
                         "` is not this one's; resume it with that version");
  }
}

// What to_string() has a name for; behind the last value it has none.
template <typename Enum>
Enum named(const std::string& name, const std::string& path) {
  const std::string none = to_string(static_cast<Enum>(UINT8_MAX));
  for (std::uint8_t i = 0;; ++i) {
    const std::string each = to_string(static_cast<Enum>(i));
    if (each == none) break;
    if (each == name) return static_cast<Enum>(i);
  }
  throw SweepFileError(path + ": was begun by another version of sinerig, which says `" + name +
                       "` of a point; resume it with that version");
}

Point point_of(const StoredPoint& stored, std::size_t pair, const std::string& path) {
  return {.dwell = stored.dwell,
          .tone = static_cast<std::uint16_t>(stored.tone),
          .pair = static_cast<std::uint16_t>(pair),
          .input = static_cast<std::uint16_t>(stored.input),
          .output = static_cast<std::uint16_t>(stored.output),
          .status = named<PointStatus>(stored.status, path),
          .reason = named<PointReason>(stored.reason, path),
          .settled_by = named<SettledBy>(stored.settled_by, path),
          .reason_value = stored.reason_value,
          .frequency_hz = stored.frequency_hz,
          .response = stored.response,
          .covariance = stored.covariance,
          .dof = stored.dof,
          .gain_interval_db = stored.gain_interval_db,
          .phase_interval_deg = stored.phase_interval_deg,
          .input_amplitude = stored.input_amplitude,
          .output_amplitude = stored.output_amplitude,
          .snr_db = stored.snr_db,
          .distortion = stored.distortion,
          .drift_per_s = stored.drift_per_s,
          .samples = stored.samples,
          .lost = stored.lost,
          .seconds = stored.seconds};
}

// Dwells in which the sweep has ended, before their measurement had. One that a soft limit has
// given up is none of them: the sweep went on behind it.
std::set<std::uint32_t> broken_off_dwells(const StoredRun& run) {
  std::set<std::uint32_t> tripped;
  for (const StoredEvent& event : run.events) {
    if (event.kind == to_string(EventKind::tripped)) tripped.insert(event.dwell);
    if (event.kind == to_string(EventKind::limited)) tripped.erase(event.dwell);
  }
  std::set<std::uint32_t> broken_off;
  for (const StoredResponse& response : run.responses) {
    for (const StoredPoint& point : response.points) {
      if (point.status != to_string(PointStatus::stopped)) continue;
      const bool by_soft_limit = point.reason == to_string(PointReason::soft_limit);
      if (!by_soft_limit || tripped.contains(point.dwell)) broken_off.insert(point.dwell);
    }
  }
  return broken_off;
}

// The last doubt of the modes that its part of the run did not live to judge.
std::optional<std::uint64_t> unjudged_doubt(const StoredRun& run) {
  std::optional<std::uint64_t> unjudged;
  std::optional<std::uint64_t> doubt;  // of the part at hand
  for (const StoredEvent& event : run.events) {
    if (event.kind == to_string(EventKind::started)) {
      if (doubt) unjudged = std::exchange(doubt, std::nullopt);
    } else if (event.kind == to_string(EventKind::model_doubted)) {
      if (event.value == doubt_begins) {
        doubt = event.tick;
      } else if (event.value < doubt_begins) {
        doubt.reset();
      }
    }
  }
  return doubt ? doubt : unjudged;
}

// Dwells whose points are those of modes that were doubted afterwards, and nobody knows whether
// rightly.
std::set<std::uint32_t> doubted_dwells(const StoredRun& run) {
  const std::optional<std::uint64_t> doubt = unjudged_doubt(run);
  if (!doubt) return {};
  std::set<std::uint32_t> modelled;
  for (const StoredResponse& response : run.responses) {
    for (const StoredPoint& point : response.points) {
      const bool stopped = point.status == to_string(PointStatus::stopped);
      if (!stopped && point.settled_by == to_string(SettledBy::model)) modelled.insert(point.dwell);
    }
  }
  std::set<std::uint32_t> doubted;
  for (const StoredTiming& timing : run.timings) {
    if (timing.first_tick <= *doubt && modelled.contains(timing.dwell))
      doubted.insert(timing.dwell);
  }
  return doubted;
}

// Finished dwells that were to be measured again and have not been: their timing is older than the
// sentence, or the new try was broken off; and those on which no sentence was passed in time.
std::set<std::uint32_t> condemned_dwells(const StoredRun& run,
                                         const std::set<std::uint32_t>& broken_off) {
  std::map<std::uint32_t, std::uint64_t> sentenced;
  for (const StoredEvent& event : run.events) {
    if (event.kind == to_string(EventKind::condemned)) sentenced[event.dwell] = event.tick;
  }
  std::set<std::uint32_t> condemned = doubted_dwells(run);
  for (const StoredTiming& timing : run.timings) {
    const auto found = sentenced.find(timing.dwell);
    if (found != sentenced.end() && timing.first_tick <= found->second)
      condemned.insert(timing.dwell);
  }
  for (const std::uint32_t dwell : broken_off) {
    if (sentenced.contains(dwell)) condemned.insert(dwell);
  }
  return condemned;
}

std::uint32_t finished_dwells(const StoredRun& run, const std::set<std::uint32_t>& broken_off,
                              const std::set<std::uint32_t>& condemned) {
  std::set<std::uint32_t> ended;
  for (const StoredTiming& timing : run.timings) ended.insert(timing.dwell);
  for (const std::uint32_t dwell : broken_off) {
    if (!condemned.contains(dwell)) ended.erase(dwell);
  }
  std::uint32_t finished = 0;
  while (ended.contains(finished)) ++finished;
  return finished;
}

std::vector<Point> points_of(const StoredRun& run, std::uint32_t dwells, const std::string& path) {
  std::vector<Point> points;
  for (std::size_t pair = 0; pair < run.responses.size(); ++pair) {
    for (const StoredPoint& point : run.responses[pair].points) {
      if (point.dwell < dwells) points.push_back(point_of(point, pair, path));
    }
  }
  std::sort(points.begin(), points.end(), [](const Point& a, const Point& b) {
    return std::tie(a.dwell, a.tone, a.pair) < std::tie(b.dwell, b.tone, b.pair);
  });
  return points;
}

std::vector<Lesson> lessons_of(Database& database) {
  std::vector<Lesson> lessons;
  Statement rows{database,
                 "SELECT dwell, attempt, tone, response, re, im, input_amplitude, white, scatter, "
                 "scatter_dof, residual_rms FROM lesson ORDER BY dwell, attempt, response, tone"};
  while (rows.step()) {
    lessons.push_back({.dwell = static_cast<std::uint32_t>(rows.integer(0)),
                       .attempt = static_cast<std::uint32_t>(rows.integer(1)),
                       .tone = static_cast<std::uint16_t>(rows.integer(2)),
                       .pair = static_cast<std::uint16_t>(rows.integer(3)),
                       .response = {rows.number(4), rows.number(5)},
                       .input_amplitude = rows.number(6),
                       .white = rows.number(7),
                       .scatter = rows.number(8),
                       .scatter_dof = rows.number(9),
                       .residual_rms = rows.number(10)});
  }
  return lessons;
}

std::int64_t one_number(Database& database, const std::string& query) {
  Statement row{database, query};
  return row.step() ? row.integer(0) : 0;
}

PartStart next_start(Database& database, std::uint32_t dwell) {
  return {.dwell = dwell,
          .tick = static_cast<std::uint64_t>(one_number(
              database,
              "SELECT 1 + max(ifnull((SELECT max(first_tick + ticks + skipped) FROM timing), -1), "
              "ifnull((SELECT max(tick) FROM event), -1), "
              "ifnull((SELECT max(tick) FROM sample), -1), "
              "ifnull((SELECT max(first_tick + block_samples) FROM block JOIN dwell ON "
              "dwell.id = block.dwell), -1), "
              "ifnull((SELECT max(first_tick) FROM part), -1))"))};
}

bool same(const Dwell& a, const Dwell& b) {
  const auto same_tone = [](const Tone& x, const Tone& y) {
    return x.cycles == y.cycles && x.amplitude == y.amplitude && x.phase_rad == y.phase_rad;
  };
  return a.asked_hz == b.asked_hz && a.block_samples == b.block_samples &&
         a.ramp_samples == b.ramp_samples && a.settle_samples == b.settle_samples &&
         a.blocks == b.blocks && a.max_samples == b.max_samples && a.sub_band == b.sub_band &&
         std::equal(a.tones.begin(), a.tones.end(), b.tones.begin(), b.tones.end(), same_tone);
}

}  // namespace

bool is_begun(const std::string& path) {
  Database database{path, Database::Mode::read};
  return !tables_of(database).empty();
}

UnfinishedRun read_unfinished(const std::string& path) {
  refuse_not_begun(path);
  UnfinishedRun run{.stored = read_sweep(path), .finished = {}, .start = {}};
  Database database{path, Database::Mode::read};
  refuse_other_layout(path, database);
  const std::set<std::uint32_t> broken_off = broken_off_dwells(run.stored);
  const std::set<std::uint32_t> condemned = condemned_dwells(run.stored, broken_off);
  const std::uint32_t dwells = finished_dwells(run.stored, broken_off, condemned);
  run.finished = {.dwells = dwells,
                  .points = points_of(run.stored, dwells, path),
                  .lessons = lessons_of(database),
                  .condemned = {condemned.begin(), condemned.lower_bound(dwells)},
                  .refined = {}};
  run.start = next_start(database, dwells);
  return run;
}

std::vector<std::uint32_t> candidates_refined(const std::string& path, const SweepPlan& stored,
                                              const SweepPlan& plan) {
  const auto refuse = [&](std::size_t dwell) {
    throw SweepFileError(path + ": this sinerig plans dwell " + std::to_string(dwell + 1) +
                         " of its rig file differently than the one that began the run; resume it "
                         "with that version");
  };
  for (std::size_t i = 0; i < plan.dwells.size(); ++i) {
    const bool there = plan.rate_hz == stored.rate_hz && i < stored.dwells.size();
    if (!there || !same(plan.dwells[i], stored.dwells[i])) refuse(i);
  }
  std::vector<std::uint32_t> added;
  const std::vector<Dwell>& candidates = plan.refinement.candidates;
  for (std::size_t i = plan.dwells.size(); i < stored.dwells.size(); ++i) {
    const auto found = std::find_if(candidates.begin(), candidates.end(), [&](const Dwell& each) {
      return same(each, stored.dwells[i]);
    });
    if (found == candidates.end() || added.size() == plan.refinement.most_points) refuse(i);
    added.push_back(static_cast<std::uint32_t>(found - candidates.begin()));
  }
  return added;
}

bool can_be_resumed(const std::string& path) noexcept {
  try {
    return !read_unfinished(path).done();
  } catch (...) {
    return false;
  }
}

}  // namespace sinerig::record
