#include "cli/configured_rig.h"

#include <algorithm>
#include <mutex>
#include <utility>

namespace sinerig::cli {

namespace {

const DriverKit& driver_of(const config::Channel& channel, const std::vector<DriverKit>& drivers) {
  const auto found = std::find_if(drivers.begin(), drivers.end(), [&](const DriverKit& driver) {
    return driver.name == channel.driver;
  });
  if (found != drivers.end()) return *found;
  std::string names;
  for (const DriverKit& driver : drivers) names += " \"" + driver.name + "\"";
  channel.section.refuse("driver", "this build has no such driver; it has" + names);
}

std::unique_ptr<Clock> make_clock(const config::Rig& rig) {
  const TickGrid grid{rig.rate_hz};
  if (rig.clock == config::ClockKind::virtual_time) return std::make_unique<VirtualClock>(grid);
  return std::make_unique<MonotonicClock>(grid);
}

}  // namespace

ConfiguredRig::ConfiguredRig(std::unique_ptr<config::RigFile> file,
                             const std::vector<DriverKit>& drivers)
    : rig_{config::read_rig(std::move(file))}, clock_{make_clock(rig_)} {
  driver_of(rig_.actuator, drivers);
  for (const config::Channel& sensor : rig_.sensors) driver_of(sensor, drivers);
  for (const DriverKit& driver : drivers) {
    DeviceRequest request{.rig = rig_, .actuator = nullptr, .sensors = {}};
    Part part;
    if (rig_.actuator.driver == driver.name) {
      request.actuator = &rig_.actuator;
      part.actuates = true;
    }
    for (std::size_t i = 0; i < rig_.sensors.size(); ++i) {
      if (rig_.sensors[i].driver != driver.name) continue;
      request.sensors.push_back(&rig_.sensors[i]);
      part.sensors.push_back(i);
    }
    if (!part.actuates && part.sensors.empty()) continue;
    part.device = driver.configure(request);
    part.device->wait_as(Waiting{control_});
    parts_.push_back(std::move(part));
  }
  rig_.file->refuse_unread();
  choose_responses();
}

// Without a choice in the file: every sensor that measures something, over what was applied.
void ConfiguredRig::choose_responses() {
  if (!rig_.runner.responses.empty()) return;
  std::vector<bool> measures(rig_.sensors.size(), true);
  for (const Part& part : parts_) {
    for (std::size_t i = 0; i < part.sensors.size(); ++i)
      measures[part.sensors[i]] = part.device->measures(i) && !rig_.sensors[part.sensors[i]].health;
  }
  for (std::size_t i = 0; i < measures.size(); ++i) {
    if (measures[i]) rig_.runner.responses.push_back({.input = 0, .output = 1 + i});
  }
  if (rig_.runner.responses.empty())
    throw config::ConfigError(
        rig_.file->name() +
        ": no sensor measures a response; add one beside the interlock and the "
        "health channels");
}

void ConfiguredRig::open() {
  sensors_.resize(rig_.sensors.size());
  for (Part& part : parts_) {
    Waiting{control_}.go_on();
    part.device->open(*clock_);
    if (part.actuates) actuator_ = part.device->actuator();
    for (std::size_t i = 0; i < part.sensors.size(); ++i) {
      sensors_[part.sensors[i]] = &part.device->sensor(i);
    }
  }
}

// What the devices say against arming, asked for as long as this lives; the first word stays.
class ConfiguredRig::Objection final : public Veto {
 public:
  explicit Objection(ConfiguredRig& rig) : rig_{rig} { rig_.control_.veto = this; }
  ~Objection() override { rig_.control_.veto = nullptr; }
  Objection(const Objection&) = delete;
  Objection& operator=(const Objection&) = delete;

  bool stands() noexcept override {
    const std::scoped_lock lock{mutex_};
    try {
      for (std::size_t i = 0; what_.empty() && i < rig_.parts_.size(); ++i)
        rig_.parts_[i].device->check_may_arm();
    } catch (const std::exception& objection) {
      what_ = objection.what();
    }
    return !what_.empty();
  }
  const std::string& what() const { return what_; }

 private:
  ConfiguredRig& rig_;
  std::mutex mutex_;  // a device may wait in a thread of its own
  std::string what_;
};

// A stop that comes as the last of them is armed is a stop, too. So is an interlock that opens
// while the list of a drive runs, which may home for minutes.
template <class Switch>
void ConfiguredRig::switch_on(Switch on) {
  const Waiting waiting{control_};
  Objection objection{*this};
  try {
    for (Part& part : parts_) {
      waiting.go_on();
      on(*part.device);
    }
    catch_up();
    waiting.go_on();
  } catch (...) {
    actuator_->release();
    if (!objection.what().empty()) throw NotToBeArmed{objection.what()};
    throw;
  }
}

void ConfiguredRig::arm() {
  switch_on([](Device& device) { device.arm(); });
}

void ConfiguredRig::catch_up() {
  for (Part& part : parts_) part.device->catch_up();
}

void ConfiguredRig::keep_released() noexcept {
  for (Part& part : parts_) part.device->keep_released();
}

std::string ConfiguredRig::not_released() const {
  for (const Part& part : parts_) {
    if (std::string missing = part.device->not_released(); !missing.empty()) return missing;
  }
  return {};
}

std::string ConfiguredRig::arm_again() {
  try {
    switch_on([](Device& device) { device.rearm(); });
    return {};
  } catch (const std::exception& refused) {
    return refused.what();
  }
}

std::vector<Remark> ConfiguredRig::remarks() const {
  std::vector<Remark> remarks;
  for (const Part& part : parts_) {
    for (Remark& remark : part.device->remarks()) remarks.push_back(std::move(remark));
  }
  return remarks;
}

bool ConfiguredRig::answers_command(std::size_t sensor) const {
  for (const Part& part : parts_) {
    const auto found = std::find(part.sensors.begin(), part.sensors.end(), sensor);
    if (found != part.sensors.end())
      return part.device->answers_command(static_cast<std::size_t>(found - part.sensors.begin()));
  }
  return false;
}

std::string ConfiguredRig::fault_reason(const Trip& trip) const {
  for (const Part& part : parts_) {
    const bool serves =
        std::find(part.sensors.begin(), part.sensors.end(), trip.channel) != part.sensors.end();
    if (trip.of_sensor() ? serves : part.actuates) return part.device->fault_reason();
  }
  return {};
}

}  // namespace sinerig::cli
