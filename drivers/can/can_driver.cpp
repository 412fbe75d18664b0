#include "drivers/can/can_driver.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <utility>

#include "drivers/can/can_config.h"

namespace sinerig::can {
namespace {

using config::RigFile;
using config::Section;

// A profile and the file it was read from, which the sections point into.
struct Profile {
  std::unique_ptr<RigFile> file;
  std::string folder;

  // [command.torque]: the kind is "command" or "feedback".
  std::optional<Section> find(const std::string& kind, const std::string& name) const {
    for (const Section& section : file->children(kind))
      if (section.name() == kind + "." + name) return section;
    return std::nullopt;
  }
  std::string names(const std::string& kind) const {
    std::string names;
    for (const Section& section : file->children(kind))
      names += " \"" + section.name().substr(kind.size() + 1) + "\"";
    return names;
  }
};

// What a channel's bits were taken for: whoever knows the device sees what is wrong.
void tell_signal(const std::string& channel, std::uint32_t id, bool extended, const Signal& signal,
                 const std::optional<DbcOrigin>& origin, std::vector<Remark>& remarks) {
  const std::string name = origin ? origin->name + ", " : "";
  remarks.push_back(
      {.text = channel + ": " + name + "frame " + id_text(id, extended) + ", " + describe(signal)});
  if (origin && origin->perhaps_float)
    remarks.push_back({.text = channel + ": " + origin->name +
                               " is a 32-bit integer with scale 1 in the DBC file; if the device "
                               "sends a float there, its SIG_VALTYPE_ is missing",
                       .doubts = true});
}

std::string folder_of(const std::string& path) {
  return std::filesystem::path(path).parent_path().string();
}

class CanDevice final : public Device {
 public:
  explicit CanDevice(const DeviceRequest& request)
      : rig_folder_{folder_of(request.rig.file->name())} {
    if (request.actuator != nullptr) {
      const Section& section = request.actuator->section;
      check_rate(section, request.rig.rate_hz);
      command_ =
          read<CommandSettings>(section, "command", [&](ConfigReader& reader, const Keys& keys) {
            return reader.command(keys, request.rig.guard.neutral);
          });
      command_interface_ = interface_of(section, needs_fd(*command_));
    }
    for (const config::Channel* sensor : request.sensors) {
      Feedback feedback;
      feedback.name = sensor->name;
      feedback.settings = read<FeedbackSettings>(
          sensor->section, "feedback",
          [](ConfigReader& reader, const Keys& keys) { return reader.feedback(keys); });
      const bool polls_fd = std::ranges::any_of(feedback.settings.polls, &Frame::fd);
      feedback.interface = interface_of(sensor->section, feedback.settings.fd || polls_fd);
      feedback_.push_back(std::move(feedback));
    }
  }

  void open(const Clock& /*clock*/) override {
    for (const Interface& interface : interfaces_)
      buses_.push_back(std::make_unique<Bus>(interface.name, interface.fd, waiting()));
    if (command_) actuator_.emplace(*buses_[command_interface_], *command_);
    for (const Feedback& feedback : feedback_)
      sensors_.push_back(
          std::make_unique<CanSensor>(*buses_[feedback.interface], feedback.settings));
    for (const auto& bus : buses_) bus->start();
    if (actuator_) actuator_->start();
  }

  // What came while nobody looked is no answer and tells nothing of the device's health.
  void arm() override {
    for (const auto& bus : buses_) bus->drain();
    if (actuator_) actuator_->arm();
  }

  void rearm() override {
    for (const auto& bus : buses_) bus->drain();
    if (!actuator_) return;
    actuator_->start();
    arm();
  }

  void keep_released() noexcept override {
    if (actuator_) actuator_->release();
  }

  std::string not_released() const override { return actuator_ ? actuator_->not_released() : ""; }

  void catch_up() override {
    for (const auto& bus : buses_) bus->drain();
    for (const auto& sensor : sensors_) sensor->catch_up();
  }

  bool answers_command(std::size_t index) const override {
    return feedback_[index].settings.answers_command;
  }

  Actuator* actuator() noexcept override { return actuator_ ? &*actuator_ : nullptr; }
  Sensor& sensor(std::size_t index) noexcept override { return *sensors_[index]; }

  std::string fault_reason() const override { return actuator_ ? actuator_->reason() : ""; }

  std::vector<Remark> remarks() const override {
    std::vector<Remark> remarks;
    for (const auto& bus : buses_) {
      const BusCounters& seen = bus->counters();
      char text[256];
      std::snprintf(text, sizeof text,
                    "can %s: %llu frames sent, %llu dropped at a full queue, %llu at a dead bus; "
                    "%llu taken in, %llu overflowed, %llu with a wrong check sum, "
                    "%llu error frames, %llu times bus-off",
                    bus->interface().c_str(), static_cast<unsigned long long>(seen.sent),
                    static_cast<unsigned long long>(seen.dropped_full),
                    static_cast<unsigned long long>(seen.dropped_dead),
                    static_cast<unsigned long long>(seen.received),
                    static_cast<unsigned long long>(seen.overflows),
                    static_cast<unsigned long long>(seen.bad_checksums),
                    static_cast<unsigned long long>(seen.error_frames),
                    static_cast<unsigned long long>(seen.bus_offs));
      remarks.push_back({.text = text});
      if (bus->state() != BusState::up)
        remarks.push_back(
            {.text = describe(bus->interface(), bus->state()), .stops_a_sweep = true});
    }
    if (command_)
      tell_signal("command", command_->frame.id, command_->frame.extended, command_->signal,
                  command_->origin, remarks);
    for (const Feedback& feedback : feedback_) {
      const FeedbackSettings& settings = feedback.settings;
      tell_signal(feedback.name, settings.pattern.id, settings.pattern.extended, settings.signal,
                  settings.origin, remarks);
    }
    return remarks;
  }

 private:
  struct Interface {
    std::string name;
    bool fd = false;
  };
  struct Feedback {
    std::string name;
    FeedbackSettings settings;
    std::size_t interface = 0;
  };

  static bool needs_fd(const CommandSettings& settings) {
    const auto has_fd = [](const Sequence& list) {
      return std::ranges::any_of(list,
                                 [](const Step& step) { return step.frame && step.frame->fd; });
    };
    return settings.frame.fd || has_fd(settings.startup) || has_fd(settings.arm) ||
           has_fd(settings.disarm) || has_fd(settings.shutdown) ||
           std::ranges::any_of(settings.keep_alive,
                               [](const KeepAlive& kept) { return kept.frame.fd; }) ||
           std::ranges::any_of(settings.health, &HealthRule::fd);
  }

  std::size_t interface_of(const Section& section, bool fd) {
    const std::string name = section.text("interface");
    for (std::size_t n = 0; n < interfaces_.size(); ++n) {
      if (interfaces_[n].name != name) continue;
      interfaces_[n].fd = interfaces_[n].fd || fd;
      return n;
    }
    interfaces_.push_back({name, fd});
    return interfaces_.size() - 1;
  }

  // The start-up list of a profile may tell the drive the period of its set-points. A rig file that
  // has it told another one says so by the same key.
  void check_rate(const Section& section, double loop_hz) {
    if (!section.has("profile")) return;
    const Profile& profile = profile_at(section);
    const Keys keys{section, rig_folder_, profile.file->section("device"), profile.folder};
    if (!keys.has("rate_hz")) return;
    if (keys.at("rate_hz").number("rate_hz", config::above_zero) == loop_hz) return;
    char text[320];
    std::snprintf(text, sizeof text,
                  "is what the start-up list sets the drive up for, and [loop] rate_hz is %g: give "
                  "the loop this rate, or add the steps that set up another one to "
                  "[[actuator.startup]] and rate_hz = %g to [actuator]",
                  loop_hz, loop_hz);
    keys.refuse("rate_hz", text);
  }

  // Reads one channel: from the rig file alone, or laid over [command.NAME] of its profile.
  template <class Settings, class Read>
  Settings read(const Section& section, const std::string& kind, Read read_settings) {
    const auto node = static_cast<std::uint32_t>(
        section.integer("node", {.min = 0.0, .max = max_extended_id}, 0));
    if (!section.has("profile")) {
      const Keys keys{section, rig_folder_};
      ConfigReader reader{std::nullopt, node};
      return read_settings(reader, keys);
    }
    const Profile& profile = profile_at(section);
    const std::string name = section.text(kind);
    const std::optional<Section> channel = profile.find(kind, name);
    if (!channel)
      section.refuse(kind, "the profile has no such " + kind + "; it has" + profile.names(kind));
    ConfigReader reader{Keys{profile.file->section("device"), profile.folder}, node};
    return read_settings(reader, Keys{section, rig_folder_, *channel, profile.folder});
  }

  // Profiles are checked as a whole, so that a mistake in a part not used yet is found today.
  const Profile& profile_at(const Section& section) {
    const std::string path =
        (std::filesystem::path(rig_folder_) / section.text("profile")).lexically_normal().string();
    const auto known = std::ranges::find_if(
        profiles_, [&](const Profile& profile) { return profile.file->name() == path; });
    if (known != profiles_.end()) return *known;
    Profile profile{RigFile::load(path), folder_of(path)};
    const Section device = profile.file->section("device");
    device.text("name");
    device.text("source");
    if (device.has("rate_hz")) device.number("rate_hz", config::above_zero);
    ConfigReader reader{Keys{device, profile.folder}, 0};
    for (const Section& command : profile.file->children("command")) {
      command.text("unit");
      reader.command(Keys{command, profile.folder}, std::nullopt);
    }
    for (const Section& feedback : profile.file->children("feedback")) {
      feedback.text("unit");
      reader.feedback(Keys{feedback, profile.folder});
    }
    profile.file->refuse_unread();
    section.include(path);
    for (const auto& [dbc, digest] : profile.file->included()) section.include(dbc);
    profiles_.push_back(std::move(profile));
    return profiles_.back();
  }

  std::string rig_folder_;
  std::vector<Profile> profiles_;
  std::vector<Interface> interfaces_;
  std::optional<CommandSettings> command_;
  std::size_t command_interface_ = 0;
  std::vector<Feedback> feedback_;

  std::vector<std::unique_ptr<Bus>> buses_;  // outlive what is on them
  std::vector<std::unique_ptr<CanSensor>> sensors_;
  std::optional<CanActuator> actuator_;
};

}  // namespace

DriverKit can_driver() {
  return {.name = "can",
          .summary = "CAN and CAN-FD devices on SocketCAN, by signal, DBC file or device profile",
          .configure = [](const DeviceRequest& request) -> std::unique_ptr<Device> {
            return std::make_unique<CanDevice>(request);
          }};
}

}  // namespace sinerig::can
