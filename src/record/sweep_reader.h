// Reads NAME.sweep back into plain values.
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "record/more_columns.h"
#include "record/sweep_writer.h"

namespace sinerig::record {

inline constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();

struct StoredPoint {
  std::uint32_t dwell = 0;
  std::uint32_t tone = 0;
  std::uint32_t input = 0;
  std::uint32_t output = 0;
  double frequency_hz = 0.0;
  std::complex<double> response{};  // NaN where no block completed
  Covariance2 covariance{};         // NaN where not known
  double dof = 0.0;                 // 0: covariance and intervals are not known
  double gain_interval_db = 0.0;    // half widths of the 95 % intervals
  double phase_interval_deg = 0.0;
  double input_amplitude = 0.0;
  double output_amplitude = 0.0;
  double snr_db = 0.0;
  double coherence = nan_value;  // as coherence() of record/confidence.h; NaN where not known
  double distortion = 0.0;
  double drift_per_s = 0.0;
  double samples = 0.0;
  double lost = 0.0;
  double seconds = 0.0;
  std::string status;
  std::string reason;
  double reason_value = 0.0;
  std::string settled_by{};            // wait, detection, model; empty where the file does not say
  std::map<std::string, double> more;  // columns that have no member above, by name
};

struct StoredEvent {
  std::uint64_t tick = 0;
  std::uint32_t dwell = 0;
  std::string kind;
  std::uint32_t channel = 0;  // 0 = none
  std::string fault;
  double value = 0.0;
  std::string detail;
};

struct StoredTiming {
  std::uint32_t dwell = 0;
  std::uint64_t first_tick = 0;
  std::uint64_t ticks = 0;
  std::uint64_t skipped = 0;
  std::uint32_t resettles = 0;
  std::int64_t max_lateness_ns = 0;
  std::string lateness_us;
  std::optional<ThreadUsage> usage{};  // nothing: virtual time, or a file from before it was kept
};

// A run is one part, and one more for each time that it was resumed.
struct StoredPart {
  std::string started_utc;
  std::string finished_utc;  // empty while it runs, and where it was killed
  std::string outcome;       // done, interrupted, stopped, killed; empty while it runs
  std::string detail;        // for people
  std::uint32_t first_dwell = 0;
  std::uint64_t first_tick = 0;
};

// The points of one pair of channels, by rising frequency.
struct StoredResponse {
  std::uint32_t input = 0;
  std::uint32_t output = 0;
  std::vector<StoredPoint> points;
  double hold_rate_hz = 0.0;  // of the zero-order hold between the two; 0: none, or not known
};

struct StoredRun {
  std::map<std::string, std::string> facts;  // the table `run`
  std::vector<ChannelInfo> channels;
  SweepPlan plan;
  std::vector<StoredResponse> responses;
  std::vector<StoredEvent> events;
  std::vector<StoredTiming> timings;
  std::vector<StoredPart> parts;          // none in files of before there were any
  std::map<std::uint32_t, double> lag_s;  // by dwell: until its points were on the disk
  std::vector<StoredFit> fits;

  // Of all dwells; nothing where none has it.
  std::optional<ThreadUsage> usage() const;

  // A fact, empty where the file has none.
  std::string fact(const std::string& key) const;
};

// Throws SweepFileError for what is no sweep file, or one of a newer version.
StoredRun read_sweep(const std::string& path);

// arg H in radians along the points, jumps above half a turn taken out.
std::vector<double> unwrapped_phase(const std::vector<StoredPoint>& points);

}  // namespace sinerig::record
