// The tables of a sweep file: what the loop tells, row by row. When they are put on the disk is the
// SweepWriter's business.
#pragma once

#include <map>
#include <memory>
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
  std::string included{};  // a line of each file that the rig file leads to, with its digest
  std::string clock;       // "virtual" or "monotonic"
  std::vector<ChannelInfo> channels;
  SweepPlan plan;
};

// Where a part of a run begins.
struct PartStart {
  std::uint32_t dwell = 0;
  std::uint64_t tick = 0;  // of the file, for the part's own tick 0
};

class RecordRows {
 public:
  // The tables must be there. Like all below: throws SweepFileError.
  RecordRows(Database& database, const RunInfo& info);
  ~RecordRows();

  // From here on ticks and attempts count on from those of the parts before.
  void begin_part(const PartStart& start);

  // A fact about the whole run.
  void set(const std::string& key, const std::string& value);
  void note_lag(std::uint32_t dwell, double lag_s);
  void insert_dwell(std::size_t index, const Dwell& dwell);
  void insert(const Record& record);

 private:
  struct Statements;

  void insert(const Point& point);
  void insert(const Block& block);
  void insert(const DwellTiming& timing);
  void insert(const Event& event);
  void insert(const Preflight& preflight);
  void insert(const Note& note);
  void insert(const TickSamples& samples);
  void insert(const Lesson& lesson);
  std::uint32_t attempt_of(std::uint32_t dwell, std::uint32_t attempt) const;

  Database& database_;
  std::vector<std::string> channel_names_;
  std::vector<std::string> sensor_names_;
  std::vector<Dwell> candidates_;  // of the plan's refinement
  std::unique_ptr<Statements> statements_;
  PartStart start_;
  std::map<std::uint32_t, std::uint32_t> attempts_;  // by dwell: those of earlier parts
};

}  // namespace sinerig::record
