#include "record/stored_point.h"

#include "record/confidence.h"

namespace sinerig::record {

StoredPoint stored_point(const Point& point, double rate_hz) {
  StoredPoint stored{.dwell = point.dwell,
                     .tone = point.tone,
                     .input = point.input,
                     .output = point.output,
                     .frequency_hz = point.frequency_hz,
                     .response = point.response,
                     .covariance = point.covariance,
                     .dof = point.dof,
                     .gain_interval_db = point.gain_interval_db,
                     .phase_interval_deg = point.phase_interval_deg,
                     .input_amplitude = point.input_amplitude,
                     .output_amplitude = point.output_amplitude,
                     .snr_db = point.snr_db,
                     .distortion = point.distortion,
                     .drift_per_s = point.drift_per_s,
                     .samples = point.samples,
                     .lost = point.lost,
                     .seconds = point.seconds,
                     .status = to_string(point.status),
                     .reason = to_string(point.reason),
                     .reason_value = point.reason_value,
                     .settled_by = to_string(point.settled_by),
                     .more = {}};
  stored.coherence = coherence(stored, rate_hz);
  return stored;
}

}  // namespace sinerig::record
