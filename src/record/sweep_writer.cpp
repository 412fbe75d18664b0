#include "record/sweep_writer.h"

#include <chrono>
#include <ctime>
#include <filesystem>
#include <utility>

#include <sqlite3.h>
#include <sys/utsname.h>

#include "record/schema.h"
#include "record/sweep_path.h"
#include "version.h"

namespace sinerig::record {

namespace {

std::string utc_now() {
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::tm parts{};
  gmtime_r(&now, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts);
  return text;
}

std::string exact(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

std::string placeholders(int count) {
  std::string text = "?";
  for (int i = 1; i < count; ++i) text += ", ?";
  return text;
}

std::string histogram_text(const DwellTiming& timing) {
  std::string text;
  for (const std::uint32_t count : timing.lateness) {
    if (!text.empty()) text += ' ';
    text += std::to_string(count);
  }
  return text;
}

}  // namespace

struct SweepWriter::Statements {
  explicit Statements(Database& database)
      : run{database, "INSERT OR REPLACE INTO run VALUES (?, ?)"},
        // A dwell that was stopped midway is replaced by its repetition, all at once.
        point{database, "INSERT OR REPLACE INTO point VALUES (" + placeholders(26) + ")"},
        block{database, "INSERT INTO block VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)"},
        timing{database, "INSERT OR REPLACE INTO timing VALUES (" + placeholders(10) + ")"},
        event{database, "INSERT INTO event VALUES (NULL, ?, ?, ?, nullif(?, 0), ?, ?, ?)"},
        sample{database, "INSERT INTO sample VALUES (?, ?, ?)"},
        lesson{database, "INSERT OR REPLACE INTO lesson VALUES (" + placeholders(11) + ")"},
        durability{database, "INSERT OR REPLACE INTO durability VALUES (?, ?)"} {}

  Statement run;
  Statement point;
  Statement block;
  Statement timing;
  Statement event;
  Statement sample;
  Statement lesson;
  Statement durability;
};

SweepWriter::SweepWriter(const std::string& path, const RunInfo& info, IfExists if_exists)
    : path_{path},
      candidates_{info.plan.refinement.candidates},
      created_{true},
      replaces_{if_exists == IfExists::replace} {
  make_way(path, replaces_);
  database_ = std::make_unique<Database>(path, Database::Mode::create);
  try {
    open(info);
    begin();
    database_->execute("PRAGMA application_id = " + std::to_string(application_id) +
                       "; PRAGMA user_version = " + std::to_string(schema_version) + ";" +
                       schema_sql);
    statements_ = std::make_unique<Statements>(*database_);
    write_head(info);
    put_on_disk();
  } catch (const FileInUse&) {
    throw;
  } catch (...) {
    discard();
    throw;
  }
}

SweepWriter::SweepWriter(const std::string& path, const RunInfo& info)
    : path_{path}, candidates_{info.plan.refinement.candidates}, created_{false} {
  lock_ = std::make_unique<FileLock>(path, file_in_use);
  database_ = std::make_unique<Database>(path, Database::Mode::write);
  open(info);
  statements_ = std::make_unique<Statements>(*database_);
}

SweepWriter::~SweepWriter() = default;

void SweepWriter::open(const RunInfo& info) {
  // A file without a page is not yet there: this makes it one.
  database_->execute("PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL;");
  if (!lock_) lock_ = std::make_unique<FileLock>(path_, file_in_use);
  spare_ = std::make_unique<SpareRoom>(path_);
  for (std::size_t i = 0; i < info.channels.size(); ++i) {
    channel_names_.push_back(info.channels[i].name);
    if (i >= first_sensor_channel) sensor_names_.push_back(info.channels[i].name);
  }
}

void SweepWriter::write_head(const RunInfo& info) {
  utsname host{};
  uname(&host);
  set("sinerig", version);
  set("sqlite", sqlite3_libversion());
  set("compiler", __VERSION__);
  set("host", host.nodename);
  set("kernel", std::string{host.sysname} + " " + host.release + " " + host.version);
  set("started_utc", utc_now());
  set("clock", info.clock);
  set("rate_hz", exact(info.plan.rate_hz));
  set("rig_name", info.rig_name);
  set("rig_path", std::filesystem::absolute(info.rig_name).lexically_normal().string());
  set("rig_text", info.rig_text);
  Statement channel{*database_, "INSERT INTO channel VALUES (?, ?, ?)"};
  for (std::size_t i = 0; i < info.channels.size(); ++i) {
    channel.bind(i, info.channels[i].name, info.channels[i].unit).run();
  }
  for (std::size_t i = 0; i < info.plan.dwells.size(); ++i) write_dwell(i, info.plan.dwells[i]);
}

void SweepWriter::begin() {
  if (!database_->in_transaction()) database_->execute("BEGIN");
}

void SweepWriter::put_on_disk() {
  if (database_->in_transaction()) database_->execute("COMMIT");
  pending_.clear();
}

void SweepWriter::commit() {
  if (!dwell_half_written_) put_on_disk();
}

void SweepWriter::begin_part(const PartStart& start) {
  start_ = start;
  attempts_.clear();
  Statement earlier{*database_,
                    "SELECT dwell, 1 + max(attempt) FROM (SELECT dwell, attempt FROM block "
                    "UNION ALL SELECT dwell, attempt FROM lesson) GROUP BY dwell"};
  while (earlier.step()) {
    attempts_[static_cast<std::uint32_t>(earlier.integer(0))] =
        static_cast<std::uint32_t>(earlier.integer(1));
  }
  begin();
  database_->execute(
      "UPDATE part SET outcome = 'killed' WHERE outcome IS NULL;"
      "DELETE FROM run WHERE key IN "
      "('outcome', 'outcome_detail', 'finished_utc', 'dropped_samples')");
  Statement part{*database_,
                 "INSERT INTO part (id, started_utc, first_dwell, first_tick) "
                 "VALUES ((SELECT count(*) FROM part), ?, ?, ?)"};
  part.bind(utc_now(), start.dwell, start.tick).run();
  put_on_disk();
  take_its_place();
}

void SweepWriter::end_part(const std::string& outcome, const std::string& detail) {
  const std::string now = utc_now();
  set("outcome", outcome);
  set("outcome_detail", detail);
  set("finished_utc", now);
  Statement part{*database_,
                 "UPDATE part SET finished_utc = ?, outcome = ?, detail = ? "
                 "WHERE id = (SELECT max(id) FROM part)"};
  part.bind(now, outcome, detail).run();
  put_on_disk();
}

void SweepWriter::finish() {
  put_on_disk();
  statements_.reset();
  try {
    database_->execute("PRAGMA journal_mode = DELETE");
  } catch (const SweepFileError&) {
    // Somebody reads it, or there is no room: the log beside it is as good.
  }
  spare_->give_back();
  take_its_place();
}

void SweepWriter::take_its_place() noexcept {
  if (std::exchange(replaces_, false)) drop_old(path_);
}

void SweepWriter::discard() {
  if (!created_) return;
  statements_.reset();
  database_.reset();
  if (replaces_) {
    put_old_back(path_);
  } else {
    remove_sweep_file(path_);
  }
}

void SweepWriter::set(const std::string& key, const std::string& value) {
  begin();
  statements_->run.bind(key, value).run();
}

void SweepWriter::note_lag(std::uint32_t dwell, double lag_s) {
  begin();
  statements_->durability.bind(dwell, lag_s).run();
}

bool SweepWriter::rescue() noexcept {
  try {
    spare_->give_back();
    if (database_->in_transaction()) database_->execute("ROLLBACK");
    std::vector<Record> lost;
    lost.swap(pending_);
    begin();
    for (const Record& record : lost) {
      std::visit([this](const auto& each) { insert(each); }, record);
    }
    put_on_disk();
    return true;
  } catch (...) {
    return false;
  }
}

void SweepWriter::write_dwell(std::size_t index, const Dwell& dwell) {
  Statement insert_dwell{*database_, "INSERT INTO dwell VALUES (?, ?, ?, ?, ?, ?, ?, ?)"};
  Statement insert_tone{*database_, "INSERT INTO tone VALUES (?, ?, ?, ?, ?)"};
  insert_dwell
      .bind(index, dwell.asked_hz, dwell.block_samples, dwell.ramp_samples, dwell.settle_samples,
            dwell.blocks, dwell.max_samples, dwell.sub_band)
      .run();
  for (std::size_t k = 0; k < dwell.tones.size(); ++k) {
    const Tone& tone = dwell.tones[k];
    insert_tone.bind(index, k, tone.cycles, tone.amplitude, tone.phase_rad).run();
  }
}

void SweepWriter::write(const Record& record) {
  const bool ends_dwell = std::holds_alternative<DwellTiming>(record);
  if (!std::holds_alternative<Block>(record) && !std::holds_alternative<TickSamples>(record)) {
    pending_.push_back(record);
  }
  if (std::holds_alternative<Point>(record)) dwell_half_written_ = true;
  begin();
  std::visit([this](const auto& each) { insert(each); }, record);
  if (!ends_dwell) return;
  dwell_half_written_ = false;
  put_on_disk();
}

void SweepWriter::insert(const Point& point) {
  statements_->point
      .bind(point.dwell, point.tone, point.pair, point.input, point.output, point.frequency_hz,
            point.response.real(), point.response.imag(), point.covariance.re_re,
            point.covariance.re_im, point.covariance.im_im, point.dof, point.gain_interval_db,
            point.phase_interval_deg, point.input_amplitude, point.output_amplitude, point.snr_db,
            point.distortion, point.drift_per_s, point.samples, point.lost, point.seconds,
            to_string(point.status), to_string(point.reason), point.reason_value,
            to_string(point.settled_by))
      .run();
}

void SweepWriter::insert(const Block& block) {
  statements_->block
      .bind(block.dwell, attempt_of(block.dwell, block.attempt), block.block, block.tone,
            block.channel, start_.tick + block.first_tick, block.coefficients.a,
            block.coefficients.b, block.coefficients.mean)
      .run();
}

void SweepWriter::insert(const DwellTiming& timing) {
  const auto usage = [&](std::uint64_t ThreadUsage::*count) {
    return timing.usage ? std::optional{*timing.usage.*count} : std::nullopt;
  };
  statements_->timing
      .bind(timing.dwell, start_.tick + timing.first_tick, timing.ticks, timing.skipped,
            timing.resettles, timing.max_lateness_ns, histogram_text(timing),
            usage(&ThreadUsage::minor_faults), usage(&ThreadUsage::major_faults),
            usage(&ThreadUsage::involuntary_switches))
      .run();
}

void SweepWriter::insert(const Event& event) {
  if (event.kind == EventKind::remeasured) {
    // What follows stands in place of what was.
    Statement{*database_, "DELETE FROM block WHERE dwell = ?"}.bind(event.dwell).run();
    attempts_.erase(event.dwell);
  }
  if (event.kind == EventKind::refined) write_dwell(event.dwell, candidates_.at(event.candidate));
  Trip trip = event.trip;
  trip.tick += start_.tick;
  const std::string detail = event.trip.tripped() ? describe(trip, sensor_names_) : "";
  statements_->event
      .bind(start_.tick + event.tick, event.dwell, to_string(event.kind), event.channel,
            to_string(event.fault), event.value, detail)
      .run();
}

void SweepWriter::insert(const Preflight& preflight) {
  statements_->event
      .bind(start_.tick + preflight.tick, preflight.dwell, to_string(EventKind::preflight),
            preflight.output, to_string(Fault::none), preflight.gain,
            describe(preflight, channel_names_))
      .run();
}

void SweepWriter::insert(const Note& note) {
  statements_->event
      .bind(start_.tick + note.tick, note.dwell, to_string(note.kind), std::uint32_t{0},
            to_string(Fault::none), 0.0, std::string{note.text.data()})
      .run();
}

void SweepWriter::insert(const TickSamples& samples) {
  for (std::uint32_t channel = 0; channel < samples.channels; ++channel) {
    statements_->sample.bind(start_.tick + samples.tick, channel, samples.values[channel]).run();
  }
}

void SweepWriter::insert(const Lesson& lesson) {
  statements_->lesson
      .bind(lesson.dwell, attempt_of(lesson.dwell, lesson.attempt), lesson.tone, lesson.pair,
            lesson.response.real(), lesson.response.imag(), lesson.input_amplitude, lesson.white,
            lesson.scatter, lesson.scatter_dof, lesson.residual_rms)
      .run();
}

// What was begun before the interruption keeps its rows.
std::uint32_t SweepWriter::attempt_of(std::uint32_t dwell, std::uint32_t attempt) const {
  const auto earlier = attempts_.find(dwell);
  return earlier == attempts_.end() ? attempt : earlier->second + attempt;
}

}  // namespace sinerig::record
