#include "drivers/modbus/modbus_driver.h"

#include <algorithm>
#include <cstdio>
#include <optional>
#include <utility>

#include "drivers/modbus/modbus_config.h"

namespace sinerig::modbus {
namespace {

using config::Section;

constexpr std::size_t trial_readings = 100;

double highest_hz(const SweepSettings& sweep) {
  double highest = std::max(sweep.start_hz, sweep.stop_hz);
  for (const SubBand& band : sweep.sub_bands)
    highest = std::max({highest, band.start_hz, band.stop_hz});
  for (const double frequency : sweep.frequencies_hz) highest = std::max(highest, frequency);
  return highest;
}

class ModbusDevice final : public Device {
 public:
  explicit ModbusDevice(const DeviceRequest& request) : highest_hz_{highest_hz(request.rig.sweep)} {
    for (const Section& section : request.rig.file->children("modbus")) {
      connections_.push_back(read_connection(section, request.rig.rate_hz));
      connections_.back().link.loop = request.rig.realtime;
    }
    if (request.actuator != nullptr) {
      const Section& section = request.actuator->section;
      command_connection_ = connection_of(section);
      command_ = read_command(request.rig, connections_[command_connection_]);
    }
    for (const config::Channel* sensor : request.sensors) {
      const std::size_t connection = connection_of(sensor->section);
      feedback_.push_back({.settings = read_feedback(sensor->section, connections_[connection]),
                           .label = "[sensor." + sensor->name + "]",
                           .connection = connection});
    }
    std::vector<std::size_t> numbers(connections_.size(), 0);
    if (command_) numbers[command_connection_] += command_->health.size();
    for (const Feedback& feedback : feedback_)
      if (++numbers[feedback.connection] > max_fields)
        request.rig.file->section("modbus").refuse(
            connections_[feedback.connection].link.connection.name,
            "more than " + std::to_string(max_fields) + " numbers are read over this connection");
  }

  void open(const Clock& /*clock*/) override {
    for (const Connection& connection : connections_)
      links_.push_back(std::make_unique<Link>(connection.link, waiting()));
    std::vector<bool> paced(links_.size(), false);
    for (const Feedback& feedback : feedback_) {
      sensors_.push_back(std::make_unique<ModbusSensor>(*links_[feedback.connection],
                                                        feedback.settings, feedback.label,
                                                        !paced[feedback.connection]));
      paced[feedback.connection] = true;
    }
    if (command_) actuator_.emplace(*links_[command_connection_], *command_);
    for (const auto& link : links_) link->open();
    if (actuator_) actuator_->start();
    for (const auto& link : links_) trials_.push_back(link->try_out(std::nullopt, trial_readings));
  }

  void arm() override {
    for (std::size_t n = 0; n < links_.size(); ++n) {
      if (command_ && n == command_connection_)
        actuator_->arm();
      else
        require_pace(*links_[n], trials_[n]);
    }
  }

  void rearm() override {
    for (const auto& link : links_) link->reconnect();
    if (!actuator_) return;
    actuator_->start();
    actuator_->arm();
  }

  void keep_released() noexcept override {
    if (actuator_) actuator_->release();
  }

  std::string not_released() const override { return actuator_ ? actuator_->not_released() : ""; }

  void catch_up() override {
    for (const auto& link : links_) link->forget();
  }

  Actuator* actuator() noexcept override { return actuator_ ? &*actuator_ : nullptr; }
  Sensor& sensor(std::size_t index) noexcept override { return *sensors_[index]; }

  std::string fault_reason() const override {
    if (actuator_ && !actuator_->reason().empty()) return actuator_->reason();
    for (const auto& link : links_)
      if (const std::string failure = link->recent_failure(); !failure.empty()) return failure;
    return "";
  }

  std::vector<Remark> remarks() const override {
    std::vector<Remark> remarks;
    for (std::size_t n = 0; n < links_.size(); ++n) {
      remarks.push_back({.text = summary(*links_[n])});
      if (const auto& grant = links_[n]->scheduling(); grant && !grant->granted)
        remarks.push_back({.text = "modbus " + links_[n]->settings().connection.name +
                                   ": its thread has not the loop's rights: " + grant->state +
                                   "; " + grant->remedy});
      if (const std::string what = obstacle(*links_[n], trials_[n]); !what.empty())
        remarks.push_back({.text = what, .stops_a_sweep = true});
      if (const std::string what = doubt(*links_[n], trials_[n], highest_hz_); !what.empty())
        remarks.push_back({.text = what});
    }
    return remarks;
  }

 private:
  struct Feedback {
    FeedbackSettings settings;
    std::string label;
    std::size_t connection = 0;
  };

  std::size_t connection_of(const Section& section) const {
    const std::string name = section.text("connection");
    std::string names;
    for (std::size_t n = 0; n < connections_.size(); ++n) {
      const std::string& known = connections_[n].link.connection.name;
      if (known == name) return n;
      names += " \"" + known + "\"";
    }
    section.refuse("connection", names.empty()
                                     ? "there is no section [modbus." + name + "]"
                                     : "there is no such section [modbus.NAME]; there is" + names);
  }

  static std::string summary(const Link& link) {
    const Pace pace = link.pace();
    const TransportCounters counters = link.counters();
    const ConnectionSettings& connection = link.settings().connection;
    char text[320];
    std::snprintf(
        text, sizeof text,
        "modbus %s, %s: %zu exchanges, %.3f ms (median), %.3f ms (95 %%), %.3f ms at most; "
        "%llu time-outs, %llu late answers dropped, %llu spoiled, %llu exceptions, "
        "%llu reconnections",
        connection.name.c_str(), connection.address().c_str(), pace.exchanges,
        static_cast<double>(pace.median_ns) * 1e-6, static_cast<double>(pace.slow_ns) * 1e-6,
        static_cast<double>(pace.worst_ns) * 1e-6,
        static_cast<unsigned long long>(counters.timeouts),
        static_cast<unsigned long long>(counters.late_answers),
        static_cast<unsigned long long>(counters.spoiled),
        static_cast<unsigned long long>(counters.exceptions),
        static_cast<unsigned long long>(counters.connections - 1));
    return text;
  }

  double highest_hz_;  // of the sweep
  std::vector<Connection> connections_;
  std::optional<CommandSettings> command_;
  std::size_t command_connection_ = 0;
  std::vector<Feedback> feedback_;

  std::vector<std::unique_ptr<Link>> links_;  // outlive what is on them
  std::vector<Pace> trials_;
  std::vector<std::unique_ptr<ModbusSensor>> sensors_;
  std::optional<ModbusActuator> actuator_;
};

}  // namespace

DriverKit modbus_driver() {
  return {.name = "modbus",
          .summary = "registers of Modbus devices, TCP and RTU (RS-485), on an I/O thread",
          .configure = [](const DeviceRequest& request) -> std::unique_ptr<Device> {
            return std::make_unique<ModbusDevice>(request);
          }};
}

}  // namespace sinerig::modbus
