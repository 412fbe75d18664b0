// ODrive's CANSimple: identifier = node · 32 + command, little-endian payloads. Written from the
// protocol's description, not with the driver's codec, so that the two check each other.
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <numbers>

#include "sim/can_servo/servo.h"

namespace sinerig::sim {
namespace {

constexpr std::int64_t heartbeat_ns = 100'000'000;
constexpr std::int64_t boot_ns = 500'000'000;
constexpr double rad_per_turn = 2.0 * std::numbers::pi;
constexpr std::int64_t never = std::numeric_limits<std::int64_t>::max();

enum Command : std::uint32_t {
  heartbeat = 0x01,
  set_axis_state = 0x07,
  get_encoder_estimates = 0x09,
  set_controller_mode = 0x0B,
  set_input_torque = 0x0E,
  get_iq = 0x14,
  reboot = 0x16,
  clear_errors = 0x18,
};

constexpr std::uint8_t state_idle = 1;
constexpr std::uint8_t state_closed_loop = 8;
constexpr std::uint32_t mode_torque = 1;
constexpr std::uint32_t error_motor_failed = 0x40;
constexpr std::uint32_t error_watchdog = 0x800;

class ODrive final : public Protocol {
 public:
  ODrive(const ServoSettings& settings, Motor& motor, Wire& wire, std::int64_t now_ns)
      : settings_{settings}, motor_{motor}, wire_{wire} {
    boot(now_ns);
  }

  void receive(const can::Frame& frame, std::int64_t time_ns) override {
    if (time_ns < alive_from_ns_ || frame.extended || frame.id >> 5U != settings_.node) return;
    last_frame_ns_ = time_ns;
    const std::uint32_t command = frame.id & 0x1FU;
    const bool asks = frame.remote || frame.length == 0;
    switch (command) {
      case set_axis_state:
        if (error_ == 0 || word(frame, 0) == state_idle) enter(word(frame, 0), time_ns);
        break;
      case set_controller_mode: mode_ = word(frame, 0); break;
      case set_input_torque: command_torque(number(frame), time_ns); break;
      case clear_errors: error_ = 0; break;
      case reboot: power_cycle(time_ns); break;
      case get_encoder_estimates:
        if (asks) send_estimates(time_ns);
        break;
      default: break;
    }
  }

  void run(std::int64_t now_ns) override {
    if (now_ns < alive_from_ns_) return;
    if (settings_.watchdog_s > 0.0 && state_ == state_closed_loop &&
        static_cast<double>(now_ns - last_frame_ns_) * 1e-9 > settings_.watchdog_s)
      fail(error_watchdog, now_ns);
    if (now_ns >= next_heartbeat_ns_) {
      send_heartbeat(now_ns);
      next_heartbeat_ns_ += heartbeat_ns;
    }
    if (now_ns >= next_feedback_ns_) {
      send_estimates(now_ns);
      next_feedback_ns_ += std::llround(settings_.feedback_s * 1e9);
    }
  }

  std::int64_t next_due_ns() const override {
    return std::min(next_heartbeat_ns_, next_feedback_ns_);
  }

  void trip(std::int64_t now_ns) override { fail(error_motor_failed, now_ns); }

  void power_cycle(std::int64_t now_ns) override {
    motor_.apply(0.0, now_ns);
    boot(now_ns + boot_ns);
  }

 private:
  void boot(std::int64_t ready_ns) {
    alive_from_ns_ = ready_ns;
    state_ = state_idle;
    mode_ = 0;
    error_ = 0;
    last_frame_ns_ = ready_ns;
    next_heartbeat_ns_ = ready_ns;
    next_feedback_ns_ = settings_.feedback_s > 0.0 ? ready_ns : never;
  }

  void enter(std::uint32_t state, std::int64_t time_ns) {
    state_ = static_cast<std::uint8_t>(state);
    if (state_ != state_closed_loop) motor_.apply(0.0, time_ns);
    send_heartbeat(time_ns);
  }

  void fail(std::uint32_t error, std::int64_t now_ns) {
    error_ |= error;
    enter(state_idle, now_ns);
  }

  void command_torque(double torque, std::int64_t time_ns) {
    const bool obeys = state_ == state_closed_loop && mode_ == mode_torque;
    if (obeys)
      motor_.apply(std::clamp(torque, -settings_.torque_max, settings_.torque_max), time_ns);
    if (settings_.reply_to_command) send_estimates(time_ns);
  }

  void send_heartbeat(std::int64_t now_ns) {
    can::Frame frame = empty(heartbeat);
    std::memcpy(frame.data.data(), &error_, 4);
    frame.data[4] = state_;
    wire_.reply(frame, now_ns);
  }

  void send_estimates(std::int64_t time_ns) {
    motor_.sample(time_ns);
    const auto turns = static_cast<float>(motor_.position() / rad_per_turn);
    const auto turns_per_s = static_cast<float>(motor_.velocity() / rad_per_turn);
    can::Frame frame = empty(get_encoder_estimates);
    std::memcpy(frame.data.data(), &turns, 4);
    std::memcpy(frame.data.data() + 4, &turns_per_s, 4);
    wire_.reply(frame, time_ns);
  }

  can::Frame empty(std::uint32_t command) const {
    can::Frame frame;
    frame.id = settings_.node << 5U | command;
    frame.length = 8;
    return frame;
  }

  static std::uint32_t word(const can::Frame& frame, std::size_t position) {
    std::uint32_t value = 0;
    std::memcpy(&value, frame.data.data() + position, 4);
    return value;
  }

  static double number(const can::Frame& frame) {
    float value = 0.0F;
    std::memcpy(&value, frame.data.data(), 4);
    return std::isfinite(value) ? static_cast<double>(value) : 0.0;
  }

  const ServoSettings& settings_;
  Motor& motor_;
  Wire& wire_;
  std::int64_t alive_from_ns_ = 0;
  std::int64_t last_frame_ns_ = 0;
  std::int64_t next_heartbeat_ns_ = 0;
  std::int64_t next_feedback_ns_ = 0;
  std::uint32_t error_ = 0;
  std::uint32_t mode_ = 0;
  std::uint8_t state_ = state_idle;
};

}  // namespace

std::unique_ptr<Protocol> make_odrive(const ServoSettings& settings, Motor& motor, Wire& wire,
                                      std::int64_t now_ns) {
  return std::make_unique<ODrive>(settings, motor, wire, now_ns);
}

}  // namespace sinerig::sim
