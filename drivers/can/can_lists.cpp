// What a channel's device is sent and must answer beside the loop's frames: lists, health,
// keep-alive; and the channel as a whole.
#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <utility>

#include "drivers/can/can_config.h"

namespace sinerig::can {
namespace {

using config::any_number;
using config::zero_or_more;

std::int64_t nanoseconds(double seconds) {
  return std::llround(seconds * 1e9);
}

}  // namespace

Pattern ConfigReader::expected(const Keys& keys) {
  Pattern pattern;
  if (keys.has("expect_answer")) {
    if (!keys.at("expect_answer").flag("expect_answer", false) || keys.has("expect_id"))
      keys.refuse("expect_answer", "is true, in place of expect_id, or left out");
    pattern.id = answer_id_;
    pattern.extended = answer_id_ > max_standard_id;
    require_bytes(keys, "expect_bytes", pattern);
    return pattern;
  }
  if (keys.has("expect_id")) {
    const auto id = static_cast<std::uint32_t>(keys.integer("expect_id", an_id));
    pattern.extended = is_extended(keys, "expect_extended", id, "expect_node_step");
    pattern.id = shifted(keys, "expect_id", id, pattern.extended, "expect_node_step");
    require_bytes(keys, "expect_bytes", pattern);
    return pattern;
  }
  const std::vector<Keys> entries = keys.tables("expect");
  if (entries.empty()) keys.refuse("expect", "needs a signal at least");
  for (const Keys& entry : entries) {
    const Place found = place_by_name(entry);
    if (&entry == &entries.front()) {
      pattern = found.pattern;
      pattern.id = found.frame.id;
      pattern.extended = found.frame.extended;
    } else if (found.frame.id != pattern.id || found.frame.extended != pattern.extended) {
      entry.refuse("signal", "is in another message than the signals before it");
    } else if (!pattern.join(found.pattern)) {
      entry.refuse("signal", "is in another page of the message than the signals before it");
    }
    Frame scratch;
    scratch.length = max_fd_bytes;
    put_value(entry, "value", scratch, found.signal);
    pattern.require(found.signal, extract_raw(scratch.payload(), found.signal));
  }
  return pattern;
}

Step ConfigReader::step(const Keys& keys) {
  Step step;
  step.name = keys.at("name").text("name");
  step.neutral = keys.at("neutral").flag("neutral", false);
  if (step.neutral && (keys.has("id") || keys.has("message") || keys.has("set")))
    keys.refuse("neutral", "sends the channel's set-point; give no frame beside it");
  if (keys.has("id")) {
    step.frame = frame(keys);
    fill(keys, *step.frame, false);
  } else if (keys.has("message")) {
    const std::string name = keys.at("message").text("message");
    step.frame = at_key(keys, "message",
                        [&] { return frame_of_message(keys, dbc(keys).find_message(name)); });
  } else if (const std::vector<Keys> entries = keys.tables("set"); !entries.empty()) {
    step.frame = place_by_name(entries.front()).frame;
    fill(keys, *step.frame, true);
  }
  if (step.frame) {
    const Checksum seal_rule = checksum(keys, step.frame->length);
    seal(*step.frame, seal_rule);
    at_key(keys, "name", [&] { check(*step.frame); });
  }
  step.delay_ns = nanoseconds(keys.number("delay_s", {.min = 0.0, .max = 60.0}, 0.0));
  step.repeats =
      static_cast<std::uint32_t>(keys.integer("repeats", {.min = 1.0, .max = 1000.0}, 1));
  if (keys.has("expect_id") || keys.has("expect_answer") || keys.has("expect")) {
    Expectation expectation;
    expectation.pattern = expected(keys);
    require_node(keys, expectation.pattern);
    if (keys.has("refuse_bytes")) {
      expectation.refusal = Pattern{};
      expectation.refusal->id = expectation.pattern.id;
      expectation.refusal->extended = expectation.pattern.extended;
      require_bytes(keys, "refuse_bytes", *expectation.refusal);
      require_node(keys, *expectation.refusal);
    }
    expectation.timeout_ns =
        nanoseconds(keys.number("timeout_s", {.min = 0.0, .max = 60.0, .open_min = true}, 0.5));
    step.expect = expectation;
  }
  return step;
}

// The device's part of a list comes first, then that of the profile's channel, then the rig's.
Sequence ConfigReader::sequence(const Keys& keys, std::string_view list) {
  Sequence sequence;
  if (device_)
    for (const Keys& entry : device_->joined_tables(list)) sequence.push_back(step(entry));
  for (const Keys& entry : keys.joined_tables(list)) sequence.push_back(step(entry));
  return sequence;
}

// Every bit that is read must come: in a payload of the length given, else in the longest there is.
void ConfigReader::check_received(const Keys& keys, const Frame& frame, const Signal& signal) {
  const std::size_t longest = frame.fd ? max_fd_bytes : max_classic_bytes;
  const std::size_t bytes = frame.length > 0 ? frame.length : longest;
  at_key(keys, keys.has("signal") ? "signal" : "start_bit", [&] { check(signal, bytes); });
}

// What decode() makes of the code that stands for a number: 3 · 0.1 is not 0.3. A device may send
// what is outside of the range that its DBC file tells.
double ConfigReader::value_of_code(const Keys& keys, std::string_view key, Signal signal) {
  signal.minimum = -std::numeric_limits<double>::infinity();
  signal.maximum = std::numeric_limits<double>::infinity();
  Frame scratch;
  scratch.length = max_fd_bytes;
  return put_value(keys, key, scratch, signal);
}

HealthRule ConfigReader::health(const Keys& keys) {
  HealthRule rule;
  rule.name = keys.at("name").text("name");
  const Place found = place(keys);
  rule.pattern = found.pattern;
  require_bytes(keys, "match_bytes", rule.pattern);
  require_node(keys, rule.pattern);
  rule.signal = found.signal;
  rule.fd = found.frame.fd;
  check_received(keys, found.frame, rule.signal);
  using Operator = HealthRule::Operator;
  const std::pair<const char*, Operator> operators[] = {{"equals", Operator::equal},
                                                        {"not", Operator::not_equal},
                                                        {"at_most", Operator::at_most},
                                                        {"at_least", Operator::at_least}};
  int given = 0;
  for (const auto& [key, comparison] : operators) {
    if (!keys.has(key)) continue;
    ++given;
    rule.comparison = comparison;
    const bool by_code = comparison == Operator::equal || comparison == Operator::not_equal;
    rule.value =
        by_code ? value_of_code(keys, key, found.signal) : keys.at(key).number(key, any_number);
  }
  if (given != 1) keys.refuse("name", "needs exactly one of equals, not, at_most, at_least");
  rule.max_age_ns = nanoseconds(keys.number("max_age_s", zero_or_more, 0.0));
  return rule;
}

void ConfigReader::watch(const Keys& keys, CommandSettings& settings) {
  for (const Keys& entry : keys.joined_tables("keep_alive")) {
    const Step sent = step(entry);
    if (!sent.frame) entry.refuse("name", "needs a frame: id, message or set");
    const double period_s = entry.at("period_s").number("period_s", zero_or_more);
    settings.keep_alive.push_back({*sent.frame, nanoseconds(period_s)});
  }
  for (const Keys& entry : keys.joined_tables("health")) settings.health.push_back(health(entry));
}

// The set-point's frame with other constant bytes.
Frame ConfigReader::released(const Keys& keys, Frame frame, bool by_name) {
  const std::vector<double> bytes = keys.at("release_bytes").numbers("release_bytes", a_byte);
  if (by_name || bytes.size() != frame.length)
    keys.refuse("release_bytes", "takes the place of bytes, and is as long as the frame");
  std::ranges::transform(bytes, frame.data.begin(),
                         [](double byte) { return static_cast<std::uint8_t>(byte); });
  fill(keys, frame, by_name);
  return frame;
}

// What is sent at every stop must not be the nearest thing that the clamp lets through.
void ConfigReader::check_neutral(const Keys& keys, const CommandSettings& settings) {
  Frame scratch = settings.frame;
  const double held = encode(scratch.payload(), settings.signal, settings.neutral);
  if (is_held(settings.signal, settings.neutral, held)) return;
  std::ostringstream rule;
  rule << "cannot carry the neutral command " << settings.neutral << ": " << held
       << " is the nearest that clamp_min, clamp_max, the DBC file's range and the bits allow";
  for (const std::string_view key : {held > settings.neutral ? "clamp_min" : "clamp_max", "signal"})
    if (keys.has(key)) keys.refuse(key, rule.str());
  keys.refuse("start_bit", rule.str());
}

CommandSettings ConfigReader::command(const Keys& keys, std::optional<double> neutral) {
  take_answer_id(keys);
  const bool by_name = keys.has("signal");
  const std::string_view where = by_name ? "signal" : "start_bit";
  Place found = place(keys);
  CommandSettings settings;
  settings.frame = found.frame;
  fill(keys, settings.frame, by_name);
  settings.signal = found.signal;
  settings.origin = found.origin;
  at_key(keys, where, [&] {
    check(settings.frame);
    check(settings.signal, settings.frame.length);
  });
  if (keys.has("release_bytes")) settings.released = released(keys, found.frame, by_name);
  settings.checksum = checksum(keys, settings.frame.length);
  settings.neutral = neutral.value_or(0.0);
  if (neutral) check_neutral(keys, settings);
  settings.startup = sequence(keys, "startup");
  settings.arm = sequence(keys, "arm");
  settings.disarm = sequence(keys, "disarm");
  settings.shutdown = sequence(keys, "shutdown");
  if (device_) watch(*device_, settings);
  watch(keys, settings);
  return settings;
}

FeedbackSettings ConfigReader::feedback(const Keys& keys) {
  take_answer_id(keys);
  const Place found = place(keys);
  FeedbackSettings settings;
  settings.signal = found.signal;
  settings.origin = found.origin;
  settings.pattern = found.pattern;
  settings.pattern.id_mask =
      static_cast<std::uint32_t>(keys.integer("id_mask", an_id, max_extended_id));
  require_bytes(keys, "match_bytes", settings.pattern);
  require_node(keys, settings.pattern);
  check_received(keys, found.frame, settings.signal);
  settings.pattern.cover(settings.signal);
  settings.checksum = checksum(keys, std::max(found.frame.length, settings.pattern.minimum_length));
  settings.fd = found.frame.fd;
  if (keys.has("invalid"))
    settings.invalid_raw = static_cast<std::uint64_t>(
        keys.integer("invalid", {.min = 0.0, .max = 9007199254740992.0}));
  settings.timeout_ns = nanoseconds(keys.number("timeout_s", zero_or_more, 0.0));
  settings.answers_command = keys.at("answers_command").flag("answers_command", false);
  for (const Keys& entry : keys.tables("poll")) {
    const Step asked = step(entry);
    if (!asked.frame) entry.refuse("name", "needs a frame: id, message or set");
    settings.polls.push_back(*asked.frame);
  }
  return settings;
}

}  // namespace sinerig::can
