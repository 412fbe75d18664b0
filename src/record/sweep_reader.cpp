#include "record/sweep_reader.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "record/confidence.h"
#include "record/schema.h"

namespace sinerig::record {

namespace {

template <typename Integer>
Integer whole(const Statement& row, int column) {
  return static_cast<Integer>(row.integer(column));
}

void check_identity(Database& database, const std::string& path) {
  if (database.pragma("application_id") != application_id) {
    throw SweepFileError(path + ": is not a sweep file");
  }
  const std::int64_t stored_version = database.pragma("user_version");
  if (stored_version > schema_version) {
    throw SweepFileError(path + ": was written by a newer sinerig (file version " +
                         std::to_string(stored_version) + ", this one reads up to " +
                         std::to_string(schema_version) + ")");
  }
}

// Columns that came after the first files of this version.
bool has_column(Database& database, const std::string& table, const std::string& name) {
  Statement column{database, "SELECT 1 FROM pragma_table_info(?) WHERE name = ?"};
  column.bind(table, name);
  return column.step();
}

void refuse_damaged(const std::string& path, const std::string& what) {
  throw SweepFileError(path + ": is damaged: " + what);
}

SweepPlan read_plan(Database& database, double rate_hz, const std::string& path) {
  SweepPlan plan{.rate_hz = rate_hz, .dwells = {}};
  const std::string sub_band = has_column(database, "dwell", "sub_band") ? "sub_band" : "0";
  Statement dwells{database,
                   "SELECT asked_hz, block_samples, ramp_samples, settle_samples, blocks, "
                   "max_samples, " +
                       sub_band + " FROM dwell ORDER BY id"};
  while (dwells.step()) {
    plan.dwells.push_back({.asked_hz = dwells.number(0),
                           .sub_band = whole<std::uint32_t>(dwells, 6),
                           .block_samples = whole<std::uint64_t>(dwells, 1),
                           .tones = {},
                           .ramp_samples = whole<std::uint64_t>(dwells, 2),
                           .settle_samples = whole<std::uint64_t>(dwells, 3),
                           .blocks = whole<std::uint32_t>(dwells, 4),
                           .max_samples = whole<std::uint64_t>(dwells, 5)});
  }
  Statement tones{database,
                  "SELECT dwell, cycles, amplitude, phase_rad FROM tone ORDER BY dwell, tone"};
  while (tones.step()) {
    const auto dwell = whole<std::size_t>(tones, 0);
    if (dwell >= plan.dwells.size())
      refuse_damaged(path, "a tone of dwell " + std::to_string(dwell) + ", which it does not have");
    plan.dwells[dwell].tones.push_back({.cycles = whole<std::uint64_t>(tones, 1),
                                        .amplitude = tones.number(2),
                                        .phase_rad = tones.number(3)});
  }
  return plan;
}

std::vector<StoredResponse> read_responses(Database& database, double rate_hz) {
  std::vector<StoredResponse> responses;
  const bool knows_settling = has_column(database, "point", "settled_by");
  Statement rows{
      database,
      "SELECT dwell, tone, input, output, freq_hz, re, im, var_re, cov_re_im, var_im, dof, "
      "gain_interval_db, phase_interval_deg, input_amplitude, output_amplitude, snr_db, "
      "distortion, drift_per_s, samples, lost, seconds, status, reason, reason_value" +
          std::string{knows_settling ? ", settled_by " : " "} +
          "FROM point ORDER BY response, freq_hz, dwell"};
  while (rows.step()) {
    StoredPoint point{.dwell = whole<std::uint32_t>(rows, 0),
                      .tone = whole<std::uint32_t>(rows, 1),
                      .input = whole<std::uint32_t>(rows, 2),
                      .output = whole<std::uint32_t>(rows, 3),
                      .frequency_hz = rows.number(4),
                      .response = {rows.number(5), rows.number(6)},
                      .covariance = {rows.number(7), rows.number(8), rows.number(9)},
                      .dof = rows.number(10),
                      .gain_interval_db = rows.number(11),
                      .phase_interval_deg = rows.number(12),
                      .input_amplitude = rows.number(13),
                      .output_amplitude = rows.number(14),
                      .snr_db = rows.number(15),
                      .distortion = rows.number(16),
                      .drift_per_s = rows.number(17),
                      .samples = rows.number(18),
                      .lost = rows.number(19),
                      .seconds = rows.number(20),
                      .status = rows.text(21),
                      .reason = rows.text(22),
                      .reason_value = rows.number(23),
                      .settled_by = knows_settling ? rows.text(24) : "",
                      .more = {}};
    point.coherence = coherence(point, rate_hz);
    const bool same_pair = !responses.empty() && responses.back().input == point.input &&
                           responses.back().output == point.output;
    if (!same_pair)
      responses.push_back({.input = point.input, .output = point.output, .points = {}});
    responses.back().points.push_back(std::move(point));
  }
  return responses;
}

std::vector<StoredEvent> read_events(Database& database) {
  std::vector<StoredEvent> events;
  Statement rows{
      database,
      "SELECT tick, dwell, kind, ifnull(channel, 0), fault, value, detail FROM event ORDER BY id"};
  while (rows.step()) {
    events.push_back({.tick = whole<std::uint64_t>(rows, 0),
                      .dwell = whole<std::uint32_t>(rows, 1),
                      .kind = rows.text(2),
                      .channel = whole<std::uint32_t>(rows, 3),
                      .fault = rows.text(4),
                      .value = rows.number(5),
                      .detail = rows.text(6)});
  }
  return events;
}

std::vector<StoredTiming> read_timings(Database& database) {
  std::vector<StoredTiming> timings;
  const std::string usage = has_column(database, "timing", "minor_faults")
                                ? "minor_faults, major_faults, involuntary_switches"
                                : "NULL, NULL, NULL";
  Statement rows{database,
                 "SELECT dwell, first_tick, ticks, skipped, resettles, max_lateness_ns, "
                 "lateness_us, " +
                     usage + " FROM timing ORDER BY dwell"};
  while (rows.step()) {
    timings.push_back({.dwell = whole<std::uint32_t>(rows, 0),
                       .first_tick = whole<std::uint64_t>(rows, 1),
                       .ticks = whole<std::uint64_t>(rows, 2),
                       .skipped = whole<std::uint64_t>(rows, 3),
                       .resettles = whole<std::uint32_t>(rows, 4),
                       .max_lateness_ns = rows.integer(5),
                       .lateness_us = rows.text(6)});
    if (!std::isnan(rows.number(7))) {
      timings.back().usage = {.minor_faults = whole<std::uint64_t>(rows, 7),
                              .major_faults = whole<std::uint64_t>(rows, 8),
                              .involuntary_switches = whole<std::uint64_t>(rows, 9)};
    }
  }
  return timings;
}

// The tables of these two came after the first files of this version.
std::vector<StoredPart> read_parts(Database& database) {
  if (!database.has_table("part")) return {};
  std::vector<StoredPart> parts;
  Statement rows{database,
                 "SELECT started_utc, finished_utc, outcome, detail, first_dwell, first_tick "
                 "FROM part ORDER BY id"};
  while (rows.step()) {
    parts.push_back({.started_utc = rows.text(0),
                     .finished_utc = rows.text(1),
                     .outcome = rows.text(2),
                     .detail = rows.text(3),
                     .first_dwell = whole<std::uint32_t>(rows, 4),
                     .first_tick = whole<std::uint64_t>(rows, 5)});
  }
  return parts;
}

std::map<std::uint32_t, double> read_lags(Database& database) {
  if (!database.has_table("durability")) return {};
  std::map<std::uint32_t, double> lags;
  Statement rows{database, "SELECT dwell, lag_s FROM durability"};
  while (rows.step()) lags[whole<std::uint32_t>(rows, 0)] = rows.number(1);
  return lags;
}

}  // namespace

std::optional<ThreadUsage> StoredRun::usage() const {
  std::optional<ThreadUsage> all;
  for (const StoredTiming& timing : timings) {
    if (timing.usage) all = all.value_or(ThreadUsage{}) + *timing.usage;
  }
  return all;
}

std::string StoredRun::fact(const std::string& key) const {
  const auto found = facts.find(key);
  return found == facts.end() ? std::string{} : found->second;
}

void check_channels(const StoredRun& run, const std::string& path) {
  const auto check = [&](std::uint32_t channel, const char* whose) {
    if (channel >= run.channels.size())
      refuse_damaged(path, whose + std::string{" of channel "} + std::to_string(channel) +
                               ", which it does not have");
  };
  for (const StoredResponse& response : run.responses) {
    check(response.input, "points");
    check(response.output, "points");
  }
  for (const StoredEvent& event : run.events) check(event.channel, "an event");
}

StoredRun read_sweep(const std::string& path) {
  if (!std::filesystem::exists(path)) throw SweepFileError(path + ": does not exist");
  Database database{path, Database::Mode::read};
  check_identity(database, path);
  // The file may be written meanwhile: all tables as they were at one moment.
  database.execute("BEGIN");

  StoredRun run;
  Statement facts{database, "SELECT key, value FROM run"};
  while (facts.step()) run.facts.emplace(facts.text(0), facts.text(1));
  Statement channels{database, "SELECT name, unit FROM channel ORDER BY id"};
  while (channels.step())
    run.channels.push_back({.name = channels.text(0), .unit = channels.text(1)});
  run.plan = read_plan(database, std::strtod(run.fact("rate_hz").c_str(), nullptr), path);
  run.responses = read_responses(database, run.plan.rate_hz);
  // What drives the plant in another response is on the loop's side of the hold, as the input is:
  // the sensitivity, torque over applied, has no plant and no hold between the two.
  for (StoredResponse& response : run.responses) {
    const bool drives =
        std::any_of(run.responses.begin(), run.responses.end(),
                    [&](const StoredResponse& each) { return each.input == response.output; });
    response.hold_rate_hz = drives ? 0.0 : run.plan.rate_hz;
  }
  read_more_columns(database, run.responses);
  run.fits = read_fits(database);
  run.events = read_events(database);
  run.timings = read_timings(database);
  run.parts = read_parts(database);
  run.lag_s = read_lags(database);
  check_channels(run, path);
  return run;
}

std::vector<double> unwrapped_phase(const std::vector<StoredPoint>& points) {
  constexpr double turn = 2.0 * std::numbers::pi;
  std::vector<double> phase;
  double previous = 0.0;
  for (const StoredPoint& point : points) {
    double value = std::arg(point.response);
    if (!phase.empty() && std::isfinite(value)) {
      value += turn * std::round((previous - value) / turn);
    }
    if (std::isfinite(value)) previous = value;
    phase.push_back(value);
  }
  return phase;
}

}  // namespace sinerig::record
