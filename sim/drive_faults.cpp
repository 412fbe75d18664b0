#include "sim/drive_faults.h"

#include <stdexcept>

namespace sinerig::sim {

void DriveFaults::look() noexcept {
  const double now_s = static_cast<double>(clock_.grid().time_ns(clock_.now().tick)) * 1e-9;
  while (next_trip_ < settings_.trips_at_s.size() && now_s >= settings_.trips_at_s[next_trip_]) {
    tripped_ = true;
    failing_ = settings_.failing_arms;
    ++next_trip_;
  }
  while (next_loss_ < settings_.lost.size() && now_s >= settings_.lost[next_loss_].to_s) {
    ++next_loss_;
  }
  lost_ = next_loss_ < settings_.lost.size() && now_s >= settings_.lost[next_loss_].from_s;
}

void DriveFaults::arm() {
  look();
  if (lost_)
    throw std::runtime_error("the simulated drive does not answer: its connection is lost");
  if (tripped_ && failing_ > 0) {
    --failing_;
    throw std::runtime_error("the simulated drive refuses to be armed: its fault is still there");
  }
  tripped_ = false;
}

Sample FaultyDrive::write(double command) noexcept {
  faults_.look();
  if (!faults_.tripped() && !faults_.lost()) return drive_.write(command);
  drive_.release();
  const Clock& clock = faults_.clock();
  return {.value = neutral_,
          .time_ns = clock.time_ns(clock.now()),
          .fault = faults_.lost() ? Fault::bus : Fault::device};
}

Sample FaultySensor::read() noexcept {
  const Sample sample = sensor_.read();
  if (!faults_.lost()) {
    last_ = sample;
    return sample;
  }
  Sample lost = last_;
  lost.fault = Fault::timeout;
  return lost;
}

Sample ErrorCode::read() noexcept {
  const Clock& clock = faults_.clock();
  return {.value = faults_.tripped() ? DriveFaults::tripped_code : 0.0,
          .time_ns = clock.time_ns(clock.now()),
          .fault = faults_.lost() ? Fault::timeout : Fault::none};
}

}  // namespace sinerig::sim
