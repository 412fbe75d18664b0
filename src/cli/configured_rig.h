// A rig file with the drivers that serve it, checked to the last key and not yet open.
#pragma once

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "config/rig.h"
#include "drivers/device.h"
#include "sweep/clock.h"
#include "sweep/retry.h"
#include "sweep/run_control.h"

namespace sinerig::cli {

// A device says that the rig may not be armed: somebody has opened an interlock.
class NotToBeArmed : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class ConfiguredRig final : public Rearm {
 public:
  // Reads the file, lets each driver read its keys, refuses every key that nobody knows.
  // Throws config::ConfigError.
  ConfiguredRig(std::unique_ptr<config::RigFile> file, const std::vector<DriverKit>& drivers);
  ConfiguredRig(const std::string& path, const std::vector<DriverKit>& drivers)
      : ConfiguredRig{config::RigFile::load(path), drivers} {}

  const config::Rig& rig() const { return rig_; }
  Clock& clock() { return *clock_; }
  // What stops the run, and whatever waits for a device.
  RunControl& control() { return control_; }

  // Acquires the hardware; the accessors below are valid from here on. Throws StopRequested, as
  // arm(), where a stop is.
  void open();
  // Where it throws, nothing is armed any more. Throws NotToBeArmed where a device forbids it,
  // before the first of them is armed or while it is.
  void arm();
  void catch_up();  // with what has come since: right before the loop
  std::string fault_reason(const Trip& trip) const override;
  std::string arm_again() override;
  void keep_released() noexcept override;
  std::string not_released() const override;
  std::vector<Remark> remarks() const;
  bool answers_command(std::size_t sensor) const;  // Device::answers_command()
  Actuator& actuator() { return *actuator_; }
  const std::vector<Sensor*>& sensors() const { return sensors_; }

 private:
  struct Part {
    std::unique_ptr<Device> device;
    bool actuates = false;
    std::vector<std::size_t> sensors;  // index in the rig of each sensor that the device serves
  };

  class Objection;

  void choose_responses();
  template <class Switch>
  void switch_on(Switch on);

  config::Rig rig_;
  std::unique_ptr<Clock> clock_;  // outlives the devices
  RunControl control_;            // likewise
  std::vector<Part> parts_;
  Actuator* actuator_ = nullptr;
  std::vector<Sensor*> sensors_;
};

}  // namespace sinerig::cli
