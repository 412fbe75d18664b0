#include "drivers/gpio/modulator.h"

#include <algorithm>
#include <cmath>

namespace sinerig::gpio {
namespace {

constexpr std::uint32_t line_bit = 1U << 0U;
constexpr std::uint32_t direction_bit = 1U << 1U;

// Rounding must not make a step back and forth of a command that stands between two.
constexpr double step_threshold = 0.5 * (1.0 + 1e-9);

}  // namespace

Drive DensityModulator::next(double command) noexcept {
  const double wanted = std::clamp(command, std::min(settings_.low, settings_.high),
                                   std::max(settings_.low, settings_.high));
  error_ += wanted;
  if (held_ == 0) {
    const double per_decision = static_cast<double>(settings_.hold_ticks);
    const double off_by = error_ - wanted + per_decision * wanted;  // when held as long
    const double middle = per_decision * (0.5 * (settings_.low + settings_.high) +
                                          dither_.next() * (settings_.high - settings_.low));
    active_ = (settings_.high > settings_.low) == (off_by > middle);
  }
  held_ = (held_ + 1) % settings_.hold_ticks;
  const double applied = active_ ? settings_.high : settings_.low;
  error_ -= applied;
  return {.levels = active_ ? line_bit : 0, .applied = applied};
}

Drive DensityModulator::rest() noexcept {
  error_ = 0.0;
  held_ = 0;
  active_ = false;
  return {.levels = 0, .applied = settings_.low};
}

Drive SignMagnitudeModulator::next(double command) noexcept {
  const double wanted = std::clamp(command, -settings_.full, settings_.full);
  error_ += wanted;
  if (pause_left_ > 0) {
    --pause_left_;
    if (pause_left_ == 0) negative_ = !negative_;
    on_ = false;
    held_ = 0;
  } else {
    if (held_ == 0) decide(wanted);
    held_ = pause_left_ > 0 ? 0 : (held_ + 1) % settings_.hold_ticks;
  }
  const double applied = !on_ ? 0.0 : negative_ ? -settings_.full : settings_.full;
  // What the pauses cost is made up for, but never more than one pause and one decision of it.
  const double most =
      settings_.full * static_cast<double>(settings_.hold_ticks + settings_.reversal_ticks);
  error_ = std::clamp(error_ - applied, -most, most);
  return {.levels = (on_ ? line_bit : 0) | (negative_ ? direction_bit : 0), .applied = applied};
}

void SignMagnitudeModulator::decide(double wanted) noexcept {
  const double per_decision = static_cast<double>(settings_.hold_ticks);
  const double off_by = error_ - wanted + per_decision * wanted;  // when held as long
  on_ = std::abs(off_by) > (0.5 + dither_.next()) * per_decision * settings_.full;
  const bool reverses = on_ && (off_by < 0.0) != negative_;
  if (!reverses) return;
  if (settings_.reversal_ticks == 0) {
    negative_ = !negative_;
    return;
  }
  on_ = false;
  pause_left_ = settings_.reversal_ticks - 1;
  if (pause_left_ == 0) negative_ = !negative_;
}

Drive SignMagnitudeModulator::rest() noexcept {
  error_ = 0.0;
  held_ = 0;
  pause_left_ = 0;
  on_ = false;
  return {.levels = negative_ ? direction_bit : 0, .applied = 0.0};
}

Drive StepModulator::next(double command) noexcept {
  since_step_ = std::min(since_step_ + 1, settings_.min_ticks);
  const double ahead = (command - settings_.origin) / settings_.step - static_cast<double>(steps_);
  if (since_step_ < settings_.min_ticks || std::abs(ahead) <= step_threshold) return drive(false);
  if ((ahead < 0.0) != negative_) {
    negative_ = !negative_;
    return drive(false);
  }
  steps_ += negative_ ? -1 : 1;
  since_step_ = 0;
  return drive(true);
}

Drive StepModulator::rest() noexcept {
  return drive(false);
}

Drive StepModulator::drive(bool active) const noexcept {
  return {.levels = (active ? line_bit : 0) | (negative_ ? direction_bit : 0),
          .applied = settings_.origin + static_cast<double>(steps_) * settings_.step};
}

}  // namespace sinerig::gpio
