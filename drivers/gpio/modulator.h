// From a command to levels: one-bit and two-bit outputs whose mean, or whose count of steps,
// follows the command. Once per tick; what they return as applied is exactly what the levels mean.
#pragma once

#include <cstdint>
#include <memory>

#include "sweep/nonblocking.h"

namespace sinerig::gpio {

struct Drive {
  std::uint32_t levels = 0;  // bit 0: the line itself (magnitude, step); bit 1: direction
  double applied = 0.0;      // unit of the command
};

class Modulator {
 public:
  virtual ~Modulator() = default;

  // The next tick's levels. `command` is finite.
  virtual Drive next(double command) noexcept SINERIG_NONBLOCKING = 0;

  // The lines refused the last next(): they still hold what was before it, and so does this.
  virtual void take_back() noexcept SINERIG_NONBLOCKING = 0;

  // What the output does when nothing more is asked of it: the last drive with the line inactive.
  virtual Drive rest() noexcept = 0;
};

// A seeded source of thresholds: without it the output of a sine repeats from cycle to cycle, and
// so does what its levels and an encoder's counts do to the response, which no scatter then shows.
class Dither {
 public:
  // `width` in levels, 0 to 1: thresholds lie within ± width / 2 of the middle.
  explicit Dither(double width) : width_{width} {}

  double next() noexcept SINERIG_NONBLOCKING {
    // xorshift64: G. Marsaglia, J. Stat. Softw. 8 (14), 2003
    state_ ^= state_ << 13U;
    state_ ^= state_ >> 7U;
    state_ ^= state_ << 17U;
    return width_ * (static_cast<double>(state_ >> 11U) * 0x1p-53 - 0.5);
  }

 private:
  double width_;
  std::uint64_t state_ = 0x9e3779b97f4a7c15;
};

struct DensitySettings {
  double low = 0.0;   // the command that the inactive line stands for
  double high = 1.0;  // and the active one
  std::uint32_t hold_ticks = 1;
  double dither = 0.0;
};

// First-order sigma-delta: the line is active for the part (command − low) / (high − low) of the
// ticks, and the error of each tick is carried to the next, so that it never exceeds one tick's
// worth. Its noise lies towards half the rate of the decisions, rate / hold_ticks.
class DensityModulator final : public Modulator {
 public:
  explicit DensityModulator(const DensitySettings& settings)
      : settings_{settings}, dither_{settings.dither} {}
  Drive next(double command) noexcept SINERIG_NONBLOCKING override;
  void take_back() noexcept SINERIG_NONBLOCKING override { state_ = before_; }
  Drive rest() noexcept override;

 private:
  struct State {
    double error = 0.0;
    bool active = false;
    std::uint32_t held = 0;  // ticks since the last decision; 0: decide
  };

  DensitySettings settings_;
  Dither dither_;
  State state_;
  State before_;
};

struct SignMagnitudeSettings {
  double full = 1.0;  // the command that an active magnitude line stands for
  std::uint32_t hold_ticks = 1;
  std::uint32_t reversal_ticks = 0;  // off for so long before the sign changes
  double dither = 0.0;
};

// The same with three levels: −full, 0, full. The direction line keeps its level while the
// magnitude is off, and changes in the last tick of a pause before a reversal.
class SignMagnitudeModulator final : public Modulator {
 public:
  explicit SignMagnitudeModulator(const SignMagnitudeSettings& settings)
      : settings_{settings}, dither_{settings.dither} {}
  Drive next(double command) noexcept SINERIG_NONBLOCKING override;
  void take_back() noexcept SINERIG_NONBLOCKING override { state_ = before_; }
  Drive rest() noexcept override;

 private:
  struct State {
    double error = 0.0;
    bool on = false;
    bool negative = false;   // the direction line
    std::uint32_t held = 0;  // ticks since the last decision; 0: decide
    std::uint32_t pause_left = 0;
  };

  void decide(double wanted) noexcept SINERIG_NONBLOCKING;

  SignMagnitudeSettings settings_;
  Dither dither_;
  State state_;
  State before_;
};

struct StepSettings {
  double step = 1.0;            // unit of the command per step
  double origin = 0.0;          // the command at which the motor stands when the sweep begins
  std::uint32_t min_ticks = 2;  // from one step to the next; at least 2
};

// A position in steps: the active edge is the step, and is at least a tick long; the direction line
// changes at least a tick before it.
class StepModulator final : public Modulator {
 public:
  explicit StepModulator(const StepSettings& settings)
      : settings_{settings}, state_{.since_step = settings.min_ticks}, before_{state_} {}
  Drive next(double command) noexcept SINERIG_NONBLOCKING override;
  void take_back() noexcept SINERIG_NONBLOCKING override { state_ = before_; }
  Drive rest() noexcept override;

 private:
  struct State {
    std::int64_t steps = 0;
    std::uint32_t since_step = 0;
    bool negative = false;
  };

  Drive drive(bool active) const noexcept SINERIG_NONBLOCKING;

  StepSettings settings_;
  State state_;
  State before_;
};

}  // namespace sinerig::gpio
