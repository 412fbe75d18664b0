// From keys to frames: reads commands, feedback, frame lists and health rules of a rig file or a
// device profile. Signals are described in place or named after a DBC file.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "drivers/can/can_actuator.h"
#include "drivers/can/can_keys.h"
#include "drivers/can/can_sensor.h"
#include "drivers/can/dbc.h"

namespace sinerig::can {

// What an identifier can be.
inline constexpr config::Range an_id{.min = 0.0, .max = max_extended_id};
inline constexpr config::Range a_byte{.min = 0.0, .max = 255.0};

// Whether `held`, what encode() made of `value`, is that but for rounding.
bool is_held(const Signal& signal, double value, double held);

class ConfigReader {
 public:
  // `device` has what all channels of a profile share: dbc, node_step, lists; none without a
  // profile. `node` is the address of the device.
  ConfigReader(std::optional<Keys> device, std::uint32_t node)
      : device_{std::move(device)}, node_{node} {}

  // All throw config::ConfigError at the key that is wrong. Without `neutral`, which is the rig's,
  // the command is read to be checked only.
  CommandSettings command(const Keys& keys, std::optional<double> neutral);
  FeedbackSettings feedback(const Keys& keys);

 private:
  // A signal, the frame it is in, and what selects it there.
  struct Place {
    Frame frame;
    Pattern pattern;
    Signal signal;
    std::optional<DbcOrigin> origin;
  };

  Place place(const Keys& keys);
  Place place_by_name(const Keys& keys);
  Place place_by_layout(const Keys& keys);
  Signal layout(const Keys& keys) const;
  void convert_unit(const Keys& keys, Signal& signal) const;
  Frame frame(const Keys& keys);
  Frame frame_of_message(const Keys& keys, const DbcMessage& message) const;
  void fill(const Keys& keys, Frame& frame, bool by_name);
  static double put_value(const Keys& entry, std::string_view key, Frame& frame,
                          const Signal& signal);
  Checksum checksum(const Keys& keys, std::size_t bytes) const;
  void require_bytes(const Keys& keys, std::string_view key, Pattern& pattern) const;
  void require_node(const Keys& keys, Pattern& pattern) const;
  Frame released(const Keys& keys, Frame frame, bool by_name);
  static void check_neutral(const Keys& keys, const CommandSettings& settings);
  Pattern expected(const Keys& keys);
  Step step(const Keys& keys);
  Sequence sequence(const Keys& keys, std::string_view list);
  static void check_received(const Keys& keys, const Frame& frame, const Signal& signal);
  static double value_of_code(const Keys& keys, std::string_view key, Signal signal);
  HealthRule health(const Keys& keys);
  void watch(const Keys& keys, CommandSettings& settings);
  const Dbc& dbc(const Keys& keys);
  std::uint32_t shifted(const Keys& keys, std::string_view key, std::uint32_t id, bool extended,
                        std::string_view step_key = "node_step") const;

  bool is_extended(const Keys& keys, std::string_view key, std::uint32_t id,
                   std::string_view step_key) const;
  std::uint64_t moved(const Keys& keys, std::uint32_t id, std::string_view step_key) const;
  std::uint32_t index_in_frame(const Keys& keys) const;
  std::uint32_t steps(const Keys& keys) const;

  // Who has `key`: the channel if it does, else the device it belongs to.
  const Keys& holder_of(std::string_view key, const Keys& keys) const {
    return keys.has(key) || !device_ ? keys : *device_;
  }

  // Where the answers of the device come, if that is not told by its node.
  void take_answer_id(const Keys& keys) {
    answer_id_ =
        static_cast<std::uint32_t>(holder_of("answer_id", keys).integer("answer_id", an_id, 0));
  }

  std::optional<Keys> device_;
  std::uint32_t node_;
  std::uint32_t answer_id_ = 0;  // of the channel that is being read
  std::map<std::string, Dbc> dbcs_;
};

}  // namespace sinerig::can
