#include "drivers/modbus/modbus_config.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>

#include "drivers/modbus/line_rates.h"

namespace sinerig::modbus {
namespace {

using config::any_number;
using config::Range;
using config::Section;
using config::zero_or_more;

constexpr Range a_register{.min = 0.0, .max = 65535.0};
constexpr Range a_unit{.min = 0.0, .max = 255.0};
// On a serial line 0 is for everybody, and nobody answers; 248 to 255 are reserved.
constexpr Range a_serial_unit{.min = 1.0, .max = 247.0};

std::int64_t nanoseconds(double seconds) {
  return std::llround(seconds * 1e9);
}

RegisterType register_type(const Section& section) {
  const std::string type =
      section.choice("type", {"uint16", "int16", "int32", "uint32", "float32", "float64"});
  if (type == "int16") return RegisterType::int16;
  if (type == "int32") return RegisterType::int32;
  if (type == "uint32") return RegisterType::uint32;
  if (type == "float32") return RegisterType::float32;
  return type == "float64" ? RegisterType::float64 : RegisterType::uint16;
}

Order order(const Section& section, std::string_view key) {
  return section.choice(key, {"high_first", "low_first"}) == "high_first" ? Order::high_first
                                                                          : Order::low_first;
}

Range unit_on(const ConnectionSettings& connection) {
  return connection.serial ? a_serial_unit : a_unit;
}

Place read_place(const Section& section, const Connection& connection) {
  Place place;
  place.unit = static_cast<std::uint8_t>(
      section.integer("unit_id", unit_on(connection.link.connection), connection.unit));
  place.address = static_cast<std::uint16_t>(section.integer("register", a_register));
  place.format.type = register_type(section);
  place.format.words = order(section, "word_order");
  place.format.bytes = order(section, "byte_order");
  place.format.scale = section.number("scale", any_number, 1.0);
  place.format.offset = section.number("offset", any_number, 0.0);
  if (place.format.scale == 0.0) section.refuse("scale", "must not be 0");
  if (place.address + place.words() > 65536)
    section.refuse("register", "a number of " + std::to_string(place.words()) +
                                   " registers does not end before register 65536");
  return place;
}

// Where something is read: feedback, health, what a list waits for.
Place read_source(const Section& section, const Connection& connection) {
  Place place = read_place(section, connection);
  if (section.choice("table", {"holding", "input"}) == "input") place.table = Table::input;
  return place;
}

std::optional<Comparison> read_comparison(const Section& section) {
  using Operator = Comparison::Operator;
  std::optional<Comparison> comparison;
  for (const auto& [key, sign] :
       {std::pair{"equals", Operator::equal}, std::pair{"not", Operator::not_equal},
        std::pair{"at_most", Operator::at_most}, std::pair{"at_least", Operator::at_least}}) {
    if (!section.has(key)) continue;
    if (comparison) section.refuse(key, "stands beside another comparison; give one");
    comparison = {.sign = sign, .value = section.number(key, any_number)};
  }
  return comparison;
}

Step read_step(const Section& section, const Connection& connection) {
  Step step;
  step.name = section.text("name");
  step.place = read_source(section, connection);
  step.writing = connection.link.writing;
  if (section.has("value")) step.write = section.number("value", any_number);
  step.expect = read_comparison(section);
  step.timeout_ns =
      nanoseconds(section.number("timeout_s", {.min = 0.0, .max = 60.0, .open_min = true}, 0.5));
  step.delay_ns = nanoseconds(section.number("delay_s", {.min = 0.0, .max = 60.0}, 0.0));
  if (step.write && step.place.table == Table::input)
    section.refuse("table", "input registers can't be written");
  if (step.write && step.writing == Writing::single && step.place.words() > 1)
    section.refuse("type", "function 6 writes one register; exchange = \"fc16\" writes more");
  return step;
}

Sequence read_sequence(const Section& section, std::string_view list,
                       const Connection& connection) {
  Sequence sequence;
  for (const Section& entry : section.tables(list))
    sequence.push_back(read_step(entry, connection));
  return sequence;
}

void require_limits_within(const config::Rig& rig, const CommandSettings& settings) {
  const Span registers = span_of(settings.place.format);
  const double rounding = 1e-6 * std::abs(settings.place.format.scale);
  const MotionLimits& motion = rig.motion;
  const auto require = [&](const char* key, double low, double high) {
    if (motion.command_min >= low - rounding && motion.command_max <= high + rounding) return;
    std::ostringstream rule;
    rule << "the command goes out as " << low << " to " << high
         << ": set [limits] command_min and command_max within";
    rig.actuator.section.refuse(key, rule.str());
  };
  require("type", registers.low, registers.high);
  require(std::isfinite(settings.minimum) ? "clamp_min" : "clamp_max", settings.minimum,
          settings.maximum);
}

void read_address(const Section& section, ConnectionSettings& settings) {
  settings.serial = section.choice("transport", {"tcp", "rtu"}) == "rtu";
  if (!settings.serial) {
    settings.host = section.text("host");
    settings.port = static_cast<int>(section.integer("port", {.min = 1.0, .max = 65535.0}, 502));
    return;
  }
  settings.device = section.text("device");
  settings.baud = static_cast<int>(section.integer("baud", {.min = 1200.0, .max = 2.5e6}, 115200));
  if (std::ranges::find(line_rates, settings.baud, &LineRate::baud) == line_rates.end()) {
    std::string rule = "must be one of";
    for (const LineRate& rate : line_rates) rule.append(" ").append(std::to_string(rate.baud));
    section.refuse("baud", rule);
  }
  const std::string parity = section.choice("parity", {"even", "none", "odd"});
  settings.parity = parity == "none" ? 'N' : parity == "odd" ? 'O' : 'E';
  settings.stop_bits = static_cast<int>(section.integer("stop_bits", {.min = 1.0, .max = 2.0}, 1));
  // 3.5 characters of 11 bits; above 19200 baud the standard recommends one time for all.
  const double silence_s = std::max(1.75e-3, 3.5 * 11.0 / settings.baud);
  settings.silence_ns =
      nanoseconds(section.number("silence_s", {.min = 0.0, .max = 0.1}, silence_s));
  const std::string rs485 = section.choice("rs485", {"adapter", "kernel", "rts_up", "rts_down"});
  settings.rs485 = rs485 == "kernel"     ? Rs485::kernel
                   : rs485 == "rts_up"   ? Rs485::rts_up
                   : rs485 == "rts_down" ? Rs485::rts_down
                                         : Rs485::adapter;
}

}  // namespace

Connection read_connection(const Section& section, double rate_hz) {
  Connection connection;
  LinkSettings& link = connection.link;
  link.connection.name = section.name().substr(sizeof "modbus");
  read_address(section, link.connection);
  connection.unit =
      static_cast<std::uint8_t>(section.integer("unit_id", unit_on(link.connection), 1));
  const std::string exchange = section.choice("exchange", {"auto", "fc23", "fc16", "fc6"});
  link.writing = exchange == "fc23"   ? Writing::write_and_read
                 : exchange == "fc16" ? Writing::multiple
                 : exchange == "fc6"  ? Writing::single
                                      : Writing::automatic;
  const double period_s = 1.0 / rate_hz;
  link.period_ns = nanoseconds(period_s);
  const double timeout_s =
      section.number("response_timeout_s", {.min = 1e-5, .max = longest_timeout * period_s},
                     usual_timeout * period_s);
  link.response_timeout_ns = nanoseconds(timeout_s);
  link.read_through =
      static_cast<std::size_t>(section.integer("read_through", {.min = 0.0, .max = 124.0}, 0));
  return connection;
}

CommandSettings read_command(const config::Rig& rig, const Connection& connection) {
  const Section& section = rig.actuator.section;
  CommandSettings settings;
  settings.place = read_place(section, connection);
  if (connection.link.writing == Writing::single && settings.place.words() > 1)
    section.refuse("type", "function 6 writes one register; exchange = \"fc16\" writes more");
  settings.minimum = section.number("clamp_min", any_number, settings.minimum);
  settings.maximum = section.number("clamp_max", any_number, settings.maximum);
  if (!(settings.minimum < settings.maximum))
    section.refuse("clamp_min", "must be below clamp_max");
  require_limits_within(rig, settings);
  settings.neutral = rig.guard.neutral;
  settings.max_age_ns = rig.guard.max_age_ns;
  settings.startup = read_sequence(section, "startup", connection);
  settings.arm = read_sequence(section, "arm", connection);
  settings.disarm = read_sequence(section, "disarm", connection);
  settings.shutdown = read_sequence(section, "shutdown", connection);
  for (const Section& entry : section.tables("health")) {
    const std::optional<Comparison> comparison = read_comparison(entry);
    if (!comparison) entry.refuse("name", "needs exactly one of equals, not, at_most, at_least");
    settings.health.push_back({.name = entry.text("name"),
                               .place = read_source(entry, connection),
                               .comparison = *comparison});
  }
  return settings;
}

FeedbackSettings read_feedback(const Section& section, const Connection& connection) {
  return {.place = read_source(section, connection),
          .wrap_modulus = section.number("wrap", zero_or_more, 0.0)};
}

}  // namespace sinerig::modbus
