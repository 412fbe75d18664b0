#include "sim/modbus_drive/settings.h"

#include <cmath>

#include "sim/sim_driver.h"

namespace sinerig::sim {
namespace {

using config::above_zero;
using config::fraction_of_one;
using config::Section;
using config::zero_or_more;

DriveFaults read_faults(const Section& section) {
  DriveFaults faults;
  faults.lost_fraction = section.number("lost_fraction", fraction_of_one, 0.0);
  faults.late_max_s = section.number("late_max_s", zero_or_more, 0.0);
  faults.late_fraction = section.number("late_fraction", fraction_of_one, 0.0);
  faults.late_s = section.number("late_s", zero_or_more, 0.0);
  faults.spoiled_fraction = section.number("spoiled_fraction", fraction_of_one, 0.0);
  faults.exception_fraction = section.number("exception_fraction", fraction_of_one, 0.0);
  faults.exception_at_s = section.number("exception_at_s", zero_or_more, 0.0);
  faults.silent_at_s = section.number("silent_at_s", zero_or_more, 0.0);
  faults.drop_at_s = section.number("drop_at_s", zero_or_more, 0.0);
  faults.power_cycle_at_s = section.number("power_cycle_at_s", zero_or_more, 0.0);
  faults.error_at_s = section.number("error_at_s", zero_or_more, 0.0);
  faults.seed = static_cast<std::uint64_t>(section.integer("seed", {.min = 0.0, .max = 9e15}, 1));
  return faults;
}

}  // namespace

DriveSettings read_drive(config::RigFile& file) {
  const Section drive = file.section("drive");
  DriveSettings settings;
  settings.serial = drive.choice("transport", {"tcp", "rtu"}) == "rtu";
  if (settings.serial) {
    settings.link = drive.text("link");
    settings.baud = static_cast<int>(drive.integer("baud", {.min = 300.0, .max = 1e7}, 115200));
    settings.bits_per_byte =
        static_cast<int>(drive.integer("bits_per_byte", {.min = 10.0, .max = 12.0}, 11));
    settings.echo = drive.flag("echo", false);
    settings.silence_ns =
        std::llround(drive.number("silence_s", {.min = 0.0, .max = 0.1}, 0.0) * 1e9);
  } else {
    settings.host = drive.text("host", settings.host);
    settings.port = static_cast<int>(drive.integer("port", {.min = 0.0, .max = 65535.0}, 0));
  }
  settings.unit =
      static_cast<std::uint8_t>(drive.integer("unit_id", {.min = 1.0, .max = 247.0}, 1));
  settings.type =
      drive.choice("type", {"float32", "float64", "int16", "uint16", "int32", "uint32"});
  settings.low_word_first = drive.choice("word_order", {"high_first", "low_first"}) == "low_first";
  settings.low_byte_first = drive.choice("byte_order", {"high_first", "low_first"}) == "low_first";
  settings.torque_scale = drive.number("torque_scale", above_zero, 1.0);
  settings.position_scale = drive.number("position_scale", above_zero, 1.0);
  settings.velocity_scale = drive.number("velocity_scale", above_zero, 1.0);
  settings.has_function_16 = drive.flag("function_16", true);
  settings.has_function_23 = drive.flag("function_23", true);
  settings.turn_around_ns =
      std::llround(drive.number("turn_around_s", {.min = 0.0, .max = 1.0}, 0.0) * 1e9);
  settings.watchdog_s = drive.number("watchdog_s", zero_or_more, 0.0);
  settings.torque_max = drive.number("torque_max", above_zero, settings.torque_max);
  settings.system = read_plant(file.section("plant"));
  if (const auto faults = file.find("faults")) settings.faults = read_faults(*faults);
  file.refuse_unread();
  return settings;
}

}  // namespace sinerig::sim
