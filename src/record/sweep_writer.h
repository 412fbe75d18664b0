// Writes NAME.sweep, one SQLite database that holds everything about one run.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "record/database.h"
#include "sweep/plan.h"
#include "sweep/records.h"

namespace sinerig::record {

struct ChannelInfo {
  std::string name;
  std::string unit;
};

// What is known before the first tick.
struct RunInfo {
  std::string rig_name;
  std::string rig_text;
  std::string clock;  // "virtual" or "monotonic"
  std::vector<ChannelInfo> channels;
  SweepPlan plan;
};

class SweepWriter {
 public:
  enum class IfExists { refuse, replace };

  // Creates the file with the plan in it. Throws SweepFileError; an existing file is left alone
  // unless it is to be replaced.
  SweepWriter(const std::string& path, const RunInfo& info, IfExists if_exists);
  ~SweepWriter();

  const std::string& path() const { return path_; }

  // Each record becomes a row; a finished point is on the disk when this returns.
  void write(const Record& record);

  // Puts what is pending on the disk.
  void commit();

  // The last word: when it ended, and the file made one plain file without a log beside it.
  void finish();

  // Removes the file: the run never began.
  void discard();

  // A fact about the whole run, such as how it ended.
  void set(const std::string& key, const std::string& value);

 private:
  struct Statements;

  void begin();
  void write_dwell(std::size_t index, const Dwell& dwell);
  void insert(const Point& point);
  void insert(const Block& block);
  void insert(const DwellTiming& timing);
  void insert(const Event& event);
  void insert(const Preflight& preflight);
  void insert(const Note& note);
  void insert(const TickSamples& samples);

  std::string path_;
  std::vector<std::string> channel_names_;
  std::vector<std::string> sensor_names_;
  std::vector<Dwell> candidates_;  // of the plan's refinement
  Database database_;
  std::unique_ptr<Statements> statements_;
  bool in_transaction_ = false;
};

}  // namespace sinerig::record
