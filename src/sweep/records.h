// What leaves the loop: plain values, copied through the outbox to whoever records them.
#pragma once

#include <array>
#include <complex>
#include <cstdint>
#include <optional>
#include <type_traits>
#include <variant>

#include "drivers/driver.h"
#include "sweep/estimator.h"
#include "sweep/guard.h"
#include "sweep/preflight.h"
#include "sweep/regression.h"
#include "sweep/thread_usage.h"

namespace sinerig {

// Channels of one run: 0 is the command, 1 what was applied, 2… the sensors in order.
inline constexpr std::size_t command_channel = 0;
inline constexpr std::size_t applied_channel = 1;
inline constexpr std::size_t first_sensor_channel = 2;
inline constexpr std::size_t max_channels = 16;

enum class PointStatus : std::uint8_t {
  good,
  unsettled,
  low_signal,
  clipped,
  distorted,
  rt_fault,
  stopped,
};

const char* to_string(PointStatus status) noexcept;

// Why a point has its status; the number that goes with it is Point::reason_value.
enum class PointReason : std::uint8_t {
  none,
  no_excitation,       // the applied signal does not hold the tone: |U| relative to the command
  no_response,         // the output does not move
  stuck,               // the output never changed its value
  output_at_range,     // part of the samples with Fault::range
  gaps,                // times the dwell had to settle again
  still_moving,        // the late half differs from the whole by this, dB
  model_at_limit,      // the dwell was over before its model met the target; as below
  target_not_reached,  // half width of the gain's interval at the end, dB
  harmonics,           // of the output, relative to the tone
  noise_burst,         // power of the loudest cluster over that of the others
  guard_trip,          // see the event of the same tick
  soft_limit,          // at the lowest amplitude that was tried, this part of the planned one
  no_data,             // the samples do not determine the tone: too few, or it cannot be told apart
};

const char* to_string(PointReason reason) noexcept;

// How a point's transient was dealt with.
enum class SettledBy : std::uint8_t {
  wait,       // waited for a fixed time
  detection,  // seen to go
  model,      // regressed along
  fallback,   // its model was abandoned; then seen to go
  both,       // regressed along, then seen to go: a modelled dwell that was checked
};

const char* to_string(SettledBy way) noexcept;

// The result of a dwell for one tone and one pair of channels.
struct Point {
  std::uint32_t dwell = 0;
  std::uint16_t tone = 0;
  std::uint16_t pair = 0;  // which of the run's responses
  std::uint16_t input = applied_channel;
  std::uint16_t output = first_sensor_channel;
  PointStatus status = PointStatus::good;
  PointReason reason = PointReason::none;
  SettledBy settled_by = SettledBy::detection;
  double reason_value = 0.0;
  double frequency_hz = 0.0;
  std::complex<double> response{};
  Covariance2 covariance{};
  double dof = 0.0;                 // degrees of freedom behind the covariance; 0: not known
  double gain_interval_db = 0.0;    // half widths of the 95 % intervals, what the transient may
  double phase_interval_deg = 0.0;  // have left included
  double input_amplitude = 0.0;     // unit of the input channel
  double output_amplitude = 0.0;    // unit of the output channel
  double snr_db = 0.0;              // tone's power over that of the residual, per sample
  double distortion = 0.0;          // harmonics beyond the noise, relative to the tone
  double drift_per_s = 0.0;         // of the output, its unit per second
  double samples = 0.0;             // that the estimate was made from
  double lost = 0.0;                // that were missing among them
  double seconds = 0.0;             // bench time of the dwell
};

// Per-block coefficients of one channel at one tone.
struct Block {
  std::uint32_t dwell = 0;
  std::uint32_t attempt = 0;  // more than one where the level was corrected
  std::uint32_t block = 0;
  std::uint16_t tone = 0;
  std::uint16_t channel = 0;
  std::uint64_t first_tick = 0;
  Coefficients coefficients{};
};

// The loop's timing in one dwell.
struct DwellTiming {
  static constexpr std::size_t bins = 24;

  std::uint32_t dwell = 0;
  std::uint64_t first_tick = 0;
  std::uint64_t ticks = 0;    // executed
  std::uint64_t skipped = 0;  // not executed
  std::uint32_t resettles = 0;
  std::int64_t max_lateness_ns = 0;
  std::array<std::uint32_t, bins>
      lateness{};  // bin k counts lateness in [2^(k−1), 2^k) µs, bin 0 below 1 µs
  std::optional<ThreadUsage> usage{};  // of the loop's thread, all tries of the dwell; see Clock
};

// What a try at a dwell has taught the ones that follow, per tone and response: kept beside the
// points, so that a sweep that goes on after an interruption expects what the first part had
// learnt.
struct Lesson {
  std::uint32_t dwell = 0;
  std::uint32_t attempt = 0;
  std::uint16_t tone = 0;
  std::uint16_t pair = 0;
  std::complex<double> response{};
  double input_amplitude = 0.0;
  double white = 0.0;    // variance of a component of H, were the residual white
  double scatter = 0.0;  // … from the clusters of the window
  double scatter_dof = 0.0;
  double residual_rms = 0.0;  // of the output
};

enum class EventKind : std::uint8_t {
  started,
  probed,  // the first pass has ended; value: modes found
  dwell_began,
  model_doubted,  // value: what came of it: 0 confirmed, 1 replaced, 2 given up, 3 see review();
                  // or see below
  checked,        // a modelled dwell, by detection; value: disagreement, dB; see Check
  condemned,   // its points have to be measured again; value: disagreement, dB, with the model of
               // the sweep; 0: its modes turned out wrong
  remeasured,  // the dwell begins once more: its model turned out wrong
  retried,     // value: amplitude of the next try
  refined,     // a dwell was added; value: disagreement that called for it, dB; candidate
  gap,         // value: ticks skipped
  actuator_fault,  // detail: Fault
  sensor_fault,    // channel, detail: Fault; the first of a run of them
  sensor_recovered,
  limited,       // a soft limit ended the dwell; see trip
  tripped,       // see trip
  device_fault,  // what a device says of its fault, in the note
  rearming,      // value: seconds until the devices are armed again
  rearm_failed,  // the note says why
  rearmed,
  preflight,  // see Preflight
  released,
  not_released,  // the actuator may go on with its last command; the note says what it has not
                 // taken
  finished,
};

const char* to_string(EventKind kind) noexcept;

// Values of model_doubted that are no verdict.
inline constexpr double doubt_begins = 4.0;  // the chirp is played again, to find out
inline constexpr double not_reviewed = 5.0;  // the sweep was resumed behind its last dwell

struct Event {
  EventKind kind = EventKind::started;
  Fault fault = Fault::none;
  std::uint16_t channel = 0;
  std::uint32_t dwell = 0;
  std::uint64_t tick = 0;
  double value = 0.0;
  std::uint32_t candidate = 0;  // of the plan's refinement
  Trip trip{};
};

// An event in words that only a device has.
struct Note {
  EventKind kind = EventKind::started;
  std::uint32_t dwell = 0;
  std::uint64_t tick = 0;
  std::array<char, 160> text{};  // ends with a 0
};

// One tick of every channel; only when the rig file asks for samples.
struct TickSamples {
  std::uint64_t tick = 0;
  std::uint32_t dwell = 0;
  std::uint32_t channels = 0;
  std::array<double, max_channels> values{};
  // A bit per channel whose value is no good sample of this tick but the one held from before.
  std::uint32_t missing = 0;
  std::array<std::int32_t, max_channels> offset_ns{};  // of the acquisition, after the tick's time

  bool good(std::size_t channel) const { return (missing >> channel & 1U) == 0; }
};

using Record = std::variant<Point, Block, DwellTiming, Event, Preflight, Note, TickSamples, Lesson>;
static_assert(std::is_trivially_copyable_v<Record>);

// Where the loop hands its records. Called from the loop's thread; may not wait or allocate.
class RecordSink {
 public:
  virtual ~RecordSink() = default;

  virtual void put(const Record& record) noexcept SINERIG_NONBLOCKING = 0;

  // May be dropped under load, and then is counted.
  virtual void put_sample(const TickSamples& samples) noexcept SINERIG_NONBLOCKING = 0;

  // Once a tick. False when records can no longer be taken: the loop has to stop.
  virtual bool flush() noexcept SINERIG_NONBLOCKING = 0;
};

}  // namespace sinerig
