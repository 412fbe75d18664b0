#include "sim/gpio_axis/settings.h"

#include <algorithm>

#include "sim/sim_driver.h"

namespace sinerig::sim {
namespace {

using config::above_zero;
using config::any_number;
using config::Section;
using config::zero_or_more;

unsigned read_line(const Section& axis, std::string_view key) {
  return static_cast<unsigned>(axis.integer(key, {.min = 0.0, .max = 1023.0}));
}

}  // namespace

AxisSettings read_axis(config::RigFile& file) {
  const Section axis = file.section("axis");
  AxisSettings settings;
  settings.chip = axis.text("chip");
  settings.output = axis.choice("output", {"density", "sign_magnitude", "step"});
  settings.line = read_line(axis, "line");
  if (settings.output != "density") settings.direction_line = read_line(axis, "direction_line");
  if (axis.has("enable_line")) settings.enable_line = read_line(axis, "enable_line");
  if (settings.output == "density") {
    settings.low = axis.number("low", any_number, settings.low);
    settings.high = axis.number("high", any_number, settings.high);
  } else if (settings.output == "sign_magnitude") {
    settings.full = axis.number("full", above_zero, settings.full);
  } else {
    settings.step = axis.number("step", above_zero);
  }
  settings.encoder_a = read_line(axis, "encoder_a");
  settings.encoder_b = read_line(axis, "encoder_b");
  settings.per_count = axis.number("per_count", above_zero);
  if (axis.has("interlock_line")) settings.interlock_line = read_line(axis, "interlock_line");
  settings.system = read_plant(file.section("plant"));
  const std::vector<std::string>& outputs = settings.system.outputs;
  const auto found = std::ranges::find(outputs, axis.text("measured", outputs.front()));
  if (found == outputs.end()) axis.refuse("measured", "the plant has no such output");
  settings.measured = static_cast<std::size_t>(found - outputs.begin());
  if (const auto faults = file.find("faults")) {
    AxisFaults& wrong = settings.faults;
    wrong.pulse_at_s = faults->number("pulse_at_s", zero_or_more, 0.0);
    wrong.burst_at_s = faults->number("burst_at_s", zero_or_more, 0.0);
    wrong.stuck_at_s = faults->number("stuck_at_s", zero_or_more, 0.0);
    wrong.interlock_at_s = faults->number("interlock_at_s", zero_or_more, 0.0);
  }
  file.refuse_unread();
  return settings;
}

double driven(const AxisSettings& settings, bool line, bool direction) {
  if (settings.output == "density") return line ? settings.high : settings.low;
  const double size = settings.output == "step" ? settings.step : settings.full;
  return !line ? 0.0 : direction ? -size : size;
}

}  // namespace sinerig::sim
