// A driver as the composition root sees it: it reads its own keys of the rig file, and opens later.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config/rig.h"
#include "drivers/driver.h"
#include "sweep/clock.h"
#include "sweep/waiting.h"

namespace sinerig {

// What people should know of a transport after it has been used for a while.
struct Remark {
  std::string text;
  bool stops_a_sweep = false;
  bool doubts = false;  // what was measured: said at the end of a run, too
};

// The channels of one rig that one driver serves. Configured without touching anything, so that a
// rig file can be checked and planned anywhere.
class Device {
 public:
  virtual ~Device() = default;

  // Before open(): how it is to wait, outside of the loop.
  void wait_as(const Waiting& waiting) { waiting_ = waiting; }

  // Acquires the hardware; throws std::runtime_error saying what failed and what to do. `clock`
  // outlives the device. The destructor leaves the actuator neutral. Where it waits, as arm() and
  // rearm(), it throws StopRequested when told to stop.
  virtual void open(const Clock& clock) = 0;

  // Asked of all devices of the rig before the first of them is armed or armed again, and by
  // whichever thread waits for one of them meanwhile: throws std::runtime_error where nothing may
  // be armed, an interlock being open.
  virtual void check_may_arm() const {}

  // Right before the first command: switches the device on. Throws like open(). A rig that is only
  // looked at is opened and never armed.
  virtual void arm() {}

  // After a fault, the actuator released: switches the device on again, which may have lost its
  // settings in a power cut meanwhile. Throws like open().
  virtual void rearm() { arm(); }

  // After all devices of the rig are armed, and again right before the loop: takes in what has
  // arrived since somebody last looked, so that no read() returns it as new. Throws like open().
  virtual void catch_up() {}

  // Outside the loop, after Actuator::release(): tries what that could not carry out.
  virtual void keep_released() noexcept {}

  // Of the last Actuator::release() or keep_released(): what the device has not taken, for people;
  // empty where it is released as far as can be told.
  virtual std::string not_released() const { return {}; }

  // Why a command had a fault or a sensor is no longer believed, for people; empty where there is
  // nothing to say.
  virtual std::string fault_reason() const { return {}; }

  // Whether a sensor is one whose response is wanted unless [sweep] responses says otherwise; an
  // interlock is not.
  virtual bool measures(std::size_t /*sensor*/) const { return true; }

  // Whether a sensor has something new only as the answer to a command: it is silent while the rig
  // is only looked at.
  virtual bool answers_command(std::size_t /*sensor*/) const { return false; }

  // Exchanges, losses, obstacles so far; not for the loop.
  virtual std::vector<Remark> remarks() const { return {}; }

  // Valid after open(). Null where the device has no actuator.
  virtual Actuator* actuator() noexcept = 0;
  virtual Sensor& sensor(std::size_t index) noexcept = 0;

 protected:
  const Waiting& waiting() const noexcept { return waiting_; }

 private:
  Waiting waiting_;
};

// What a driver is asked to serve: pointers into the rig, which outlives the call.
struct DeviceRequest {
  const config::Rig& rig;
  const config::Channel* actuator = nullptr;
  std::vector<const config::Channel*> sensors;
};

struct DriverKit {
  std::string name;     // of `driver = "…"` in the rig file
  std::string summary;  // one line for `sinerig drivers`
  std::function<std::unique_ptr<Device>(const DeviceRequest&)> configure;
};

}  // namespace sinerig
