#include "sweep/records.h"

namespace sinerig {

const char* to_string(PointStatus status) noexcept {
  switch (status) {
    case PointStatus::good: return "good";
    case PointStatus::unsettled: return "unsettled";
    case PointStatus::low_signal: return "low_signal";
    case PointStatus::clipped: return "clipped";
    case PointStatus::distorted: return "distorted";
    case PointStatus::rt_fault: return "rt_fault";
    case PointStatus::stopped: return "stopped";
  }
  return "unknown";
}

const char* to_string(SettledBy way) noexcept {
  switch (way) {
    case SettledBy::wait: return "wait";
    case SettledBy::detection: return "detection";
    case SettledBy::model: return "model";
    case SettledBy::fallback: return "fallback";
    case SettledBy::both: return "both";
  }
  return "unknown";
}

const char* to_string(PointReason reason) noexcept {
  switch (reason) {
    case PointReason::none: return "";
    case PointReason::no_excitation: return "no_excitation";
    case PointReason::no_response: return "no_response";
    case PointReason::stuck: return "stuck";
    case PointReason::still_moving: return "still_moving";
    case PointReason::model_at_limit: return "model_at_limit";
    case PointReason::target_not_reached: return "target_not_reached";
    case PointReason::harmonics: return "harmonics";
    case PointReason::noise_burst: return "noise_burst";
    case PointReason::output_at_range: return "output_at_range";
    case PointReason::gaps: return "gaps";
    case PointReason::guard_trip: return "guard_trip";
    case PointReason::soft_limit: return "soft_limit";
    case PointReason::no_data: return "no_data";
  }
  return "unknown";
}

const char* to_string(EventKind kind) noexcept {
  switch (kind) {
    case EventKind::started: return "started";
    case EventKind::probed: return "probed";
    case EventKind::model_doubted: return "model_doubted";
    case EventKind::checked: return "checked";
    case EventKind::condemned: return "condemned";
    case EventKind::remeasured: return "remeasured";
    case EventKind::dwell_began: return "dwell_began";
    case EventKind::retried: return "retried";
    case EventKind::refined: return "refined";
    case EventKind::gap: return "gap";
    case EventKind::actuator_fault: return "actuator_fault";
    case EventKind::sensor_fault: return "sensor_fault";
    case EventKind::sensor_recovered: return "sensor_recovered";
    case EventKind::limited: return "limited";
    case EventKind::tripped: return "tripped";
    case EventKind::device_fault: return "device_fault";
    case EventKind::rearming: return "rearming";
    case EventKind::rearm_failed: return "rearm_failed";
    case EventKind::rearmed: return "rearmed";
    case EventKind::preflight: return "preflight";
    case EventKind::released: return "released";
    case EventKind::not_released: return "not_released";
    case EventKind::finished: return "finished";
  }
  return "unknown";
}

}  // namespace sinerig
