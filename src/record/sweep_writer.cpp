#include "record/sweep_writer.h"

#include <chrono>
#include <ctime>
#include <filesystem>
#include <utility>

#include <sqlite3.h>
#include <sys/utsname.h>

#include "record/schema.h"
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

// The path itself, once it is free to be created.
const std::string& free_path(const std::string& path, SweepWriter::IfExists if_exists) {
  namespace fs = std::filesystem;
  if (!fs::exists(path)) return path;
  if (if_exists == SweepWriter::IfExists::refuse) {
    throw FileExists(path +
                     ": exists already; choose another name with -o, or --force to replace it");
  }
  for (const char* suffix : {"", "-wal", "-shm"}) fs::remove(path + suffix);
  return path;
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
        point{database, "INSERT OR REPLACE INTO point VALUES (" + placeholders(26) + ")"},
        block{database, "INSERT INTO block VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)"},
        timing{database, "INSERT OR REPLACE INTO timing VALUES (?, ?, ?, ?, ?, ?, ?)"},
        event{database, "INSERT INTO event VALUES (NULL, ?, ?, ?, nullif(?, 0), ?, ?, ?)"},
        sample{database, "INSERT INTO sample VALUES (?, ?, ?)"} {}

  Statement run;
  Statement point;
  Statement block;
  Statement timing;
  Statement event;
  Statement sample;
};

SweepWriter::SweepWriter(const std::string& path, const RunInfo& info, IfExists if_exists)
    : path_{path}, database_{free_path(path, if_exists), Database::Mode::create} {
  database_.execute("PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL;");
  begin();
  database_.execute("PRAGMA application_id = " + std::to_string(application_id) +
                    "; PRAGMA user_version = " + std::to_string(schema_version) + ";" + schema_sql);
  statements_ = std::make_unique<Statements>(database_);

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
  set("rig_text", info.rig_text);
  Statement channel{database_, "INSERT INTO channel VALUES (?, ?, ?)"};
  for (std::size_t i = 0; i < info.channels.size(); ++i) {
    channel.bind(i, info.channels[i].name, info.channels[i].unit).run();
    if (i >= first_sensor_channel) sensor_names_.push_back(info.channels[i].name);
  }
  for (std::size_t i = 0; i < info.plan.dwells.size(); ++i) write_dwell(i, info.plan.dwells[i]);
  candidates_ = info.plan.refinement.candidates;
  commit();
}

SweepWriter::~SweepWriter() = default;

void SweepWriter::begin() {
  if (in_transaction_) return;
  database_.execute("BEGIN");
  in_transaction_ = true;
}

void SweepWriter::commit() {
  if (!in_transaction_) return;
  database_.execute("COMMIT");
  in_transaction_ = false;
}

void SweepWriter::finish() {
  set("finished_utc", utc_now());
  commit();
  database_.execute("PRAGMA journal_mode = DELETE");
}

void SweepWriter::discard() {
  for (const char* suffix : {"", "-wal", "-shm"}) std::filesystem::remove(path_ + suffix);
}

void SweepWriter::set(const std::string& key, const std::string& value) {
  begin();
  statements_->run.bind(key, value).run();
}

void SweepWriter::write_dwell(std::size_t index, const Dwell& dwell) {
  Statement insert_dwell{database_, "INSERT INTO dwell VALUES (?, ?, ?, ?, ?, ?, ?, ?)"};
  Statement insert_tone{database_, "INSERT INTO tone VALUES (?, ?, ?, ?, ?)"};
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
  begin();
  std::visit([this](const auto& each) { insert(each); }, record);
  // The timing closes a dwell: its points are durable before the next one ends.
  if (std::holds_alternative<DwellTiming>(record)) commit();
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
      .bind(block.dwell, block.attempt, block.block, block.tone, block.channel, block.first_tick,
            block.coefficients.a, block.coefficients.b, block.coefficients.mean)
      .run();
}

void SweepWriter::insert(const DwellTiming& timing) {
  statements_->timing
      .bind(timing.dwell, timing.first_tick, timing.ticks, timing.skipped, timing.resettles,
            timing.max_lateness_ns, histogram_text(timing))
      .run();
}

void SweepWriter::insert(const Event& event) {
  if (event.kind == EventKind::remeasured) {
    // What follows stands in place of what was.
    Statement{database_, "DELETE FROM block WHERE dwell = ?"}.bind(event.dwell).run();
  }
  if (event.kind == EventKind::refined) write_dwell(event.dwell, candidates_.at(event.candidate));
  const std::string detail =
      event.kind == EventKind::tripped ? describe(event.trip, sensor_names_) : "";
  statements_->event
      .bind(event.tick, event.dwell, to_string(event.kind), event.channel, to_string(event.fault),
            event.value, detail)
      .run();
}

void SweepWriter::insert(const TickSamples& samples) {
  for (std::uint32_t channel = 0; channel < samples.channels; ++channel) {
    statements_->sample.bind(samples.tick, channel, samples.values[channel]).run();
  }
}

}  // namespace sinerig::record
