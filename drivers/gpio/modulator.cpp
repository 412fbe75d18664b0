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
  before_ = state_;
  const double wanted = std::clamp(command, std::min(settings_.low, settings_.high),
                                   std::max(settings_.low, settings_.high));
  state_.error += wanted;
  if (state_.held == 0) {
    const double per_decision = static_cast<double>(settings_.hold_ticks);
    const double off_by = state_.error - wanted + per_decision * wanted;  // when held as long
    const double middle = per_decision * (0.5 * (settings_.low + settings_.high) +
                                          dither_.next() * (settings_.high - settings_.low));
    state_.active = (settings_.high > settings_.low) == (off_by > middle);
  }
  state_.held = (state_.held + 1) % settings_.hold_ticks;
  const double applied = state_.active ? settings_.high : settings_.low;
  state_.error -= applied;
  return {.levels = state_.active ? line_bit : 0, .applied = applied};
}

Drive DensityModulator::rest() noexcept {
  state_.error = 0.0;
  state_.held = 0;
  state_.active = false;
  return {.levels = 0, .applied = settings_.low};
}

Drive SignMagnitudeModulator::next(double command) noexcept {
  before_ = state_;
  const double wanted = std::clamp(command, -settings_.full, settings_.full);
  state_.error += wanted;
  if (state_.pause_left > 0) {
    --state_.pause_left;
    if (state_.pause_left == 0) state_.negative = !state_.negative;
    state_.on = false;
    state_.held = 0;
  } else {
    if (state_.held == 0) decide(wanted);
    state_.held = state_.pause_left > 0 ? 0 : (state_.held + 1) % settings_.hold_ticks;
  }
  const double applied = !state_.on ? 0.0 : state_.negative ? -settings_.full : settings_.full;
  // What the pauses cost is made up for, but never more than one pause and one decision of it.
  const double most =
      settings_.full * static_cast<double>(settings_.hold_ticks + settings_.reversal_ticks);
  state_.error = std::clamp(state_.error - applied, -most, most);
  return {.levels = (state_.on ? line_bit : 0) | (state_.negative ? direction_bit : 0),
          .applied = applied};
}

void SignMagnitudeModulator::decide(double wanted) noexcept {
  const double per_decision = static_cast<double>(settings_.hold_ticks);
  const double off_by = state_.error - wanted + per_decision * wanted;  // when held as long
  state_.on = std::abs(off_by) > (0.5 + dither_.next()) * per_decision * settings_.full;
  const bool reverses = state_.on && (off_by < 0.0) != state_.negative;
  if (!reverses) return;
  if (settings_.reversal_ticks == 0) {
    state_.negative = !state_.negative;
    return;
  }
  state_.on = false;
  state_.pause_left = settings_.reversal_ticks - 1;
  if (state_.pause_left == 0) state_.negative = !state_.negative;
}

Drive SignMagnitudeModulator::rest() noexcept {
  state_.error = 0.0;
  state_.held = 0;
  state_.pause_left = 0;
  state_.on = false;
  return {.levels = state_.negative ? direction_bit : 0, .applied = 0.0};
}

Drive StepModulator::next(double command) noexcept {
  before_ = state_;
  state_.since_step = std::min(state_.since_step + 1, settings_.min_ticks);
  const double ahead =
      (command - settings_.origin) / settings_.step - static_cast<double>(state_.steps);
  if (state_.since_step < settings_.min_ticks || std::abs(ahead) <= step_threshold)
    return drive(false);
  if ((ahead < 0.0) != state_.negative) {
    state_.negative = !state_.negative;
    return drive(false);
  }
  state_.steps += state_.negative ? -1 : 1;
  state_.since_step = 0;
  return drive(true);
}

Drive StepModulator::rest() noexcept {
  return drive(false);
}

Drive StepModulator::drive(bool active) const noexcept {
  return {.levels = (active ? line_bit : 0) | (state_.negative ? direction_bit : 0),
          .applied = settings_.origin + static_cast<double>(state_.steps) * settings_.step};
}

}  // namespace sinerig::gpio
