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

constexpr const char* displaced =
    "was removed, renamed or replaced by another file while it was being written";

bool is_in_use(const std::string& path) {
  try {
    const FileLock nobody_writes{path, file_in_use};
  } catch (const FileInUse&) {
    return true;
  } catch (const SweepFileError&) {
    // There is none, or it is not ours to write.
  }
  return false;
}

// Of a file that is not there yet: the name, or the first with a number behind it.
std::string free_name(const std::string& wanted) {
  std::string name = wanted;
  std::error_code error;
  for (int number = 2; std::filesystem::exists(name, error); ++number) {
    name = wanted + "-" + std::to_string(number);
  }
  return name;
}

}  // namespace

SweepWriter::SweepWriter(const std::string& path, const RunInfo& info, IfExists if_exists)
    : path_{path}, created_{true}, replaces_{if_exists == IfExists::replace} {
  lock_ = claim_path(path, replaces_);
  try {
    database_ = std::make_unique<Database>(path, Database::Mode::write);
    open();
    begin();
    database_->execute("PRAGMA application_id = " + std::to_string(application_id) +
                       "; PRAGMA user_version = " + std::to_string(schema_version) + ";" +
                       schema_sql);
    rows_ = std::make_unique<RecordRows>(*database_, info);
    write_head(info);
    put_on_disk();
  } catch (...) {
    discard();
    throw;
  }
}

SweepWriter::SweepWriter(const std::string& path, const RunInfo& info)
    : path_{path}, created_{false} {
  lock_ = std::make_unique<FileLock>(path, file_in_use);
  database_ = std::make_unique<Database>(path, Database::Mode::write);
  open();
  rows_ = std::make_unique<RecordRows>(*database_, info);
}

SweepWriter::~SweepWriter() = default;

void SweepWriter::open() {
  database_->execute("PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL;");
  spare_ = std::make_unique<SpareRoom>(path_);
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
  if (!info.included.empty()) set("included", info.included);
  Statement channel{*database_, "INSERT INTO channel VALUES (?, ?, ?)"};
  for (std::size_t i = 0; i < info.channels.size(); ++i) {
    channel.bind(i, info.channels[i].name, info.channels[i].unit).run();
  }
  for (std::size_t i = 0; i < info.plan.dwells.size(); ++i)
    rows_->insert_dwell(i, info.plan.dwells[i]);
}

void SweepWriter::begin() {
  if (!database_->in_transaction()) database_->execute("BEGIN");
}

void SweepWriter::commit_rows() {
  if (database_->in_transaction()) database_->execute("COMMIT");
  pending_.clear();
}

// A file without a name takes everything that is written to it, and is gone with the last handle.
void SweepWriter::put_on_disk() {
  commit_rows();
  if (!displaced_ && lost_its_name()) throw SweepFileError(path_ + ": " + displaced);
}

bool SweepWriter::lost_its_name() {
  if (displaced_ || !lock_->displaced(path_)) return displaced_;
  displaced_ = true;
  return true;
}

void SweepWriter::write_rescued() {
  const std::string lost = std::exchange(path_, free_name(path_ + "-rescued"));
  Statement copy{*database_, "VACUUM INTO ?"};
  copy.bind(path_).run();
  // The log would be taken for that of whatever stands under the name now, unless it is.
  if (!is_in_use(lost)) remove_leftovers(lost);
  throw SweepFileError(path_ + ": holds what was measured; " + lost + " " + displaced);
}

void SweepWriter::commit() {
  if (!dwell_half_written_) put_on_disk();
}

void SweepWriter::begin_part(const PartStart& start) {
  rows_->begin_part(start);
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
  commit_rows();
  rows_.reset();
  if (lost_its_name()) {
    spare_->give_back();
    write_rescued();
  }
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
  rows_.reset();
  database_.reset();
  if (displaced_) return;  // what stands there now is somebody else's
  if (replaces_) {
    put_old_back(path_);
  } else {
    remove_sweep_file(path_);
  }
}

void SweepWriter::set(const std::string& key, const std::string& value) {
  begin();
  rows_->set(key, value);
}

void SweepWriter::note_lag(std::uint32_t dwell, double lag_s) {
  begin();
  rows_->note_lag(dwell, lag_s);
}

bool SweepWriter::rescue() noexcept {
  try {
    spare_->give_back();
    if (database_->in_transaction()) database_->execute("ROLLBACK");
    std::vector<Record> lost;
    lost.swap(pending_);
    begin();
    for (const Record& record : lost) rows_->insert(record);
    put_on_disk();
    return true;
  } catch (...) {
    return false;
  }
}

void SweepWriter::write(const Record& record) {
  const bool ends_dwell = std::holds_alternative<DwellTiming>(record);
  if (!std::holds_alternative<Block>(record) && !std::holds_alternative<TickSamples>(record)) {
    pending_.push_back(record);
  }
  if (std::holds_alternative<Point>(record)) dwell_half_written_ = true;
  begin();
  rows_->insert(record);
  if (!ends_dwell) return;
  dwell_half_written_ = false;
  put_on_disk();
}

}  // namespace sinerig::record
