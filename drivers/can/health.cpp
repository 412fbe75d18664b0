#include "drivers/can/health.h"

#include <algorithm>
#include <sstream>

namespace sinerig::can {
namespace {

bool holds(const HealthRule& rule, double value) noexcept {
  switch (rule.comparison) {
    case HealthRule::Operator::equal: return value == rule.value;
    case HealthRule::Operator::not_equal: return value != rule.value;
    case HealthRule::Operator::at_most: return value <= rule.value;
    case HealthRule::Operator::at_least: return value >= rule.value;
  }
  return false;
}

}  // namespace

Health::Health(Bus& bus, std::vector<HealthRule> rules)
    : bus_(bus), rules_(std::move(rules)), counts_at_begin_(rules_.size(), 0) {
  for (HealthRule& rule : rules_) {
    rule.pattern.cover(rule.signal);
    rule.slot = bus.listen(rule.pattern, rule.checksum);
  }
}

void Health::begin() noexcept {
  begin_ns_ = monotonic_ns();
  for (std::size_t n = 0; n < rules_.size(); ++n)
    counts_at_begin_[n] = bus_.slot(rules_[n].slot).count;
}

const HealthRule* Health::violated(std::int64_t now_ns) const noexcept {
  for (std::size_t n = 0; n < rules_.size(); ++n) {
    const HealthRule& rule = rules_[n];
    const Slot& slot = bus_.slot(rule.slot);
    const bool seen = slot.count != counts_at_begin_[n];
    const std::int64_t last_ns = seen ? std::max(slot.time_ns, begin_ns_) : begin_ns_;
    if (rule.max_age_ns > 0 && now_ns - last_ns > rule.max_age_ns) return &rule;
    if (seen && !holds(rule, decode(slot.frame.payload(), rule.signal))) return &rule;
  }
  return nullptr;
}

std::string Health::describe(const HealthRule& rule) const {
  static constexpr const char* signs[] = {"=", "not", "<=", ">="};
  const Slot& slot = bus_.slot(rule.slot);
  std::ostringstream text;
  text << rule.name;
  if (slot.count == 0) {
    text << " never came";
  } else {
    const double value = decode(slot.frame.payload(), rule.signal);
    text << " is " << value << ", must be " << signs[static_cast<int>(rule.comparison)] << ' '
         << rule.value;
    if (holds(rule, value)) text << ", and is older than allowed";
  }
  if (rule.max_age_ns > 0)
    text << " (every " << static_cast<double>(rule.max_age_ns) * 1e-6 << " ms)";
  return text.str();
}

}  // namespace sinerig::can
