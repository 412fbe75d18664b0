// The packed protocol of the MIT mini-cheetah, as Damiao drives speak it: five big-endian bit
// fields of 16, 12, 12, 12 and 12 bits; enable, disable and zero are FF … FC, FD, FE. Written from
// the protocol's description, not with the driver's codec, so that the two check each other.
//
// The two gains act on the position and velocity of the moment a frame arrives.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "sim/can_servo/servo.h"

namespace sinerig::sim {
namespace {

constexpr std::int64_t boot_ns = 500'000'000;
constexpr double kp_max = 500.0;
constexpr double kd_max = 5.0;

enum State : std::uint8_t {
  disabled = 0x0,
  enabled = 0x1,
  over_temperature = 0xB,
  link_lost = 0xD,
};

double unpacked(std::uint32_t code, double min, double max, unsigned bits) {
  return min + code * (max - min) / (std::ldexp(1.0, static_cast<int>(bits)) - 1.0);
}

std::uint32_t packed(double value, double limit, unsigned bits) {
  const double highest = std::ldexp(1.0, static_cast<int>(bits)) - 1.0;
  const double code = (std::clamp(value, -limit, limit) + limit) * highest / (2.0 * limit);
  return static_cast<std::uint32_t>(std::lround(code));
}

class Mit final : public Protocol {
 public:
  Mit(const ServoSettings& settings, Motor& motor, Wire& wire, std::int64_t now_ns)
      : settings_{settings}, motor_{motor}, wire_{wire} {
    power_cycle(now_ns - boot_ns);
  }

  void receive(const can::Frame& frame, std::int64_t time_ns) override {
    if (time_ns < alive_from_ns_ || frame.extended || frame.length != 8 ||
        frame.id != settings_.node)
      return;
    last_frame_ns_ = time_ns;
    if (is_order(frame)) {
      obey(frame.data[7], time_ns);
    } else if (state_ == enabled) {
      move(frame, time_ns);
    }
    reply(time_ns);
  }

  void run(std::int64_t now_ns) override {
    if (settings_.watchdog_s > 0.0 && state_ == enabled &&
        static_cast<double>(now_ns - last_frame_ns_) * 1e-9 > settings_.watchdog_s)
      stop(link_lost, now_ns);
  }

  std::int64_t next_due_ns() const override {
    if (settings_.watchdog_s <= 0.0 || state_ != enabled)
      return std::numeric_limits<std::int64_t>::max();
    return last_frame_ns_ + std::llround(settings_.watchdog_s * 1e9) + 1;
  }

  void trip(std::int64_t now_ns) override { stop(over_temperature, now_ns); }

  void power_cycle(std::int64_t now_ns) override {
    stop(disabled, now_ns);
    alive_from_ns_ = now_ns + boot_ns;
    zero_ = 0.0;
  }

 private:
  static bool is_order(const can::Frame& frame) {
    return frame.data[7] >= 0xFB && std::all_of(frame.data.begin(), frame.data.begin() + 7,
                                                [](auto b) { return b == 0xFF; });
  }

  void obey(std::uint8_t order, std::int64_t time_ns) {
    if (order == 0xFB) state_ = disabled;
    if (order == 0xFC && (state_ == disabled || state_ == enabled)) state_ = enabled;
    if (order == 0xFD) stop(disabled, time_ns);
    if (order == 0xFE) {
      motor_.sample(time_ns);
      zero_ = motor_.position();
    }
  }

  void stop(State state, std::int64_t time_ns) {
    state_ = state;
    motor_.apply(0.0, time_ns);
  }

  void move(const can::Frame& frame, std::int64_t time_ns) {
    const auto& d = frame.data;
    const double position =
        unpacked(d[0] * 256U + d[1], -settings_.position_max, settings_.position_max, 16);
    const double velocity =
        unpacked(d[2] * 16U + d[3] / 16U, -settings_.velocity_max, settings_.velocity_max, 12);
    const double kp = unpacked(d[3] % 16U * 256U + d[4], 0.0, kp_max, 12);
    const double kd = unpacked(d[5] * 16U + d[6] / 16U, 0.0, kd_max, 12);
    const double torque =
        unpacked(d[6] % 16U * 256U + d[7], -settings_.torque_max, settings_.torque_max, 12);
    motor_.sample(time_ns);
    const double total = kp * (position - (motor_.position() - zero_)) +
                         kd * (velocity - motor_.velocity()) + torque;
    motor_.apply(std::clamp(total, -settings_.torque_max, settings_.torque_max), time_ns);
  }

  void reply(std::int64_t time_ns) {
    motor_.sample(time_ns);
    const std::uint32_t position = packed(motor_.position() - zero_, settings_.position_max, 16);
    const std::uint32_t velocity = packed(motor_.velocity(), settings_.velocity_max, 12);
    const std::uint32_t torque = packed(motor_.torque(), settings_.torque_max, 12);
    can::Frame frame;
    frame.id = settings_.reply_id;
    frame.length = 8;
    const std::uint32_t bytes[8] = {settings_.node % 16U + state_ * 16U,
                                    position / 256U,
                                    position % 256U,
                                    velocity / 16U,
                                    velocity % 16U * 16U + torque / 256U,
                                    torque % 256U,
                                    25U,
                                    30U};
    std::ranges::transform(bytes, frame.data.begin(),
                           [](std::uint32_t byte) { return static_cast<std::uint8_t>(byte); });
    wire_.reply(frame, time_ns);
  }

  const ServoSettings& settings_;
  Motor& motor_;
  Wire& wire_;
  std::int64_t alive_from_ns_ = 0;
  std::int64_t last_frame_ns_ = 0;
  double zero_ = 0.0;
  State state_ = disabled;
};

}  // namespace

std::unique_ptr<Protocol> make_mit(const ServoSettings& settings, Motor& motor, Wire& wire,
                                   std::int64_t now_ns) {
  return std::make_unique<Mit>(settings, motor, wire, now_ns);
}

}  // namespace sinerig::sim
