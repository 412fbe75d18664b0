#include "sim/can_servo/servo.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/sim_driver.h"

namespace sinerig::sim {
namespace {

using config::above_zero;
using config::fraction_of_one;
using config::Section;
using config::zero_or_more;

}  // namespace

ServoSettings read_servo(config::RigFile& file) {
  const Section servo = file.section("servo");
  ServoSettings settings;
  settings.interface = servo.text("interface");
  settings.protocol = servo.choice("protocol", {"odrive", "mit"});
  settings.node = static_cast<std::uint32_t>(servo.integer("node", {.min = 0.0, .max = 63.0}, 0));
  settings.feedback_s = servo.number("feedback_s", zero_or_more, settings.feedback_s);
  settings.reply_to_command = servo.flag("reply_to_command", settings.protocol == "mit");
  settings.watchdog_s = servo.number("watchdog_s", zero_or_more, settings.watchdog_s);
  settings.torque_max = servo.number("torque_max", above_zero, settings.torque_max);
  settings.position_max = servo.number("position_max", above_zero, settings.position_max);
  settings.velocity_max = servo.number("velocity_max", above_zero, settings.velocity_max);
  settings.reply_id =
      static_cast<std::uint32_t>(servo.integer("reply_id", {.min = 0.0, .max = 2047.0}, 0));
  settings.system = read_plant(file.section("plant"));
  if (const auto faults = file.find("faults")) {
    ServoFaults& wrong = settings.faults;
    wrong.lost_fraction = faults->number("lost_fraction", fraction_of_one, 0.0);
    wrong.late_max_s = faults->number("late_max_s", zero_or_more, 0.0);
    wrong.silent_at_s = faults->number("silent_at_s", zero_or_more, 0.0);
    wrong.power_cycle_at_s = faults->number("power_cycle_at_s", zero_or_more, 0.0);
    wrong.bus_off_at_s = faults->number("bus_off_at_s", zero_or_more, 0.0);
    wrong.bus_off_for_s = faults->number("bus_off_for_s", zero_or_more, 0.0);
    wrong.error_at_s = faults->number("error_at_s", zero_or_more, 0.0);
    wrong.seed = static_cast<std::uint64_t>(faults->integer("seed", {.min = 0.0, .max = 9e15}, 1));
  }
  file.refuse_unread();
  return settings;
}

Wire::Wire(can::Socket& socket, const ServoFaults& faults, std::int64_t start_ns)
    : socket_{socket}, faults_{faults}, start_ns_{start_ns}, random_{faults.seed} {}

void Wire::reply(const can::Frame& frame, std::int64_t now_ns) {
  if (cut_) return;
  const double running_s = static_cast<double>(now_ns - start_ns_) * 1e-9;
  if (faults_.silent_at_s > 0.0 && running_s >= faults_.silent_at_s) return;
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  if (faults_.lost_fraction > 0.0 && uniform(random_) < faults_.lost_fraction) return;
  if (faults_.late_max_s > 0.0) {
    const double late_s = faults_.late_max_s * uniform(random_);
    late_.push_back({now_ns + std::llround(late_s * 1e9), frame});
    return;
  }
  socket_.send(frame);
}

std::int64_t Wire::send_due(std::int64_t now_ns) {
  std::ranges::stable_sort(late_, {}, &Late::due_ns);
  std::size_t sent = 0;
  while (sent < late_.size() && late_[sent].due_ns <= now_ns) socket_.send(late_[sent++].frame);
  late_.erase(late_.begin(), late_.begin() + static_cast<std::ptrdiff_t>(sent));
  return late_.empty() ? std::numeric_limits<std::int64_t>::max() : late_.front().due_ns;
}

}  // namespace sinerig::sim
