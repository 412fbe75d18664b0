// Writes NAME.sweep, one SQLite database that holds everything about one run.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "record/database.h"
#include "record/file_lock.h"
#include "record/record_rows.h"
#include "record/spare_room.h"
#include "sweep/records.h"

namespace sinerig::record {

class SweepWriter {
 public:
  enum class IfExists { refuse, replace };

  // Creates the file with the plan in it. Throws SweepFileError; an existing file is left alone
  // unless it is to be replaced, and one that is being written in any case. What is to be replaced
  // is gone with begin_part().
  SweepWriter(const std::string& path, const RunInfo& info, IfExists if_exists);

  // Opens the file of an interrupted run; it stays as it is until begin_part(). Throws FileInUse
  // while its run goes on, SweepFileError.
  SweepWriter(const std::string& path, const RunInfo& info);
  ~SweepWriter();

  const std::string& path() const { return path_; }

  // From here on records are those of a new part. A part before it that was never ended was killed.
  void begin_part(const PartStart& start);

  // Each record becomes a row; a finished dwell is on the disk when this returns. Like all that
  // puts something on the disk this throws SweepFileError where the file has been removed, renamed
  // or replaced by another one since; once, and the rows are kept.
  void write(const Record& record);

  // Puts what is pending on the disk, but never a part of a dwell's points.
  void commit();

  // How far behind the loop a dwell's points reached the disk; kept with the next commit.
  void note_lag(std::uint32_t dwell, double lag_s);

  // The disk is full or gone: gives back the room that was spared, and tries once more to put down
  // all but blocks and samples since the last commit. False where that failed, too.
  bool rescue() noexcept;

  // The last word: how and when it ended, and the file made one plain file without a log beside it,
  // unless somebody is reading it or the disk has no room for that. What has lost its name is put
  // down as NAME.sweep-rescued, which is path() then, and SweepFileError says so.
  void end_part(const std::string& outcome, const std::string& detail);
  void finish();

  // The run never began: removes the file that it was created for, puts back what that was to
  // replace, leaves one that it was opened for. The last that this is asked for.
  void discard();

  // A fact about the whole run.
  void set(const std::string& key, const std::string& value);

 private:
  void open();
  void begin();
  void put_on_disk();
  void commit_rows();
  bool lost_its_name();
  void write_rescued();
  void take_its_place() noexcept;
  void write_head(const RunInfo& info);

  std::string path_;
  bool created_;                    // not resumed
  bool replaces_ = false;           // an earlier file, set aside meanwhile
  bool displaced_ = false;          // it stands under its name no more
  std::unique_ptr<FileLock> lock_;  // outlives the database
  std::unique_ptr<SpareRoom> spare_;
  std::unique_ptr<Database> database_;
  std::unique_ptr<RecordRows> rows_;
  std::vector<Record> pending_;  // since the last commit, but blocks and samples
  bool dwell_half_written_ = false;
};

}  // namespace sinerig::record
