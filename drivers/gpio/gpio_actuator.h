// Output lines as the actuator of the loop.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "drivers/driver.h"
#include "drivers/gpio/lines.h"
#include "drivers/gpio/modulator.h"
#include "sweep/clock.h"

namespace sinerig::gpio {

struct OutputSettings {
  double neutral = 0.0;
  bool safe_active = false;  // level of the line, the magnitude or the step while released
  std::uint32_t enable = 0;  // bit of the enable line; 0: there is none
};

class GpioActuator final : public Actuator {
 public:
  // The lines have the levels safe_levels(settings). `clock` must outlive the actuator.
  GpioActuator(std::unique_ptr<OutputLines> lines, std::unique_ptr<Modulator> modulator,
               const OutputSettings& settings, const Clock& clock)
      : lines_{std::move(lines)},
        modulator_{std::move(modulator)},
        settings_{settings},
        clock_{clock} {}
  ~GpioActuator() override { release(); }

  static std::uint32_t safe_levels(const OutputSettings& settings) noexcept {
    return settings.safe_active ? 1U : 0U;
  }

  // The enable line becomes active with the first write.
  // Fault::range: the command was no number, neutral went out instead. Fault::bus: the kernel
  // refused; the value is then what the lines held before.
  Sample write(double command) noexcept SINERIG_NONBLOCKING override;

  // Every line to its safe level. What the kernel refused is tried again by the next release() and
  // by the destructor.
  void release() noexcept override;
  bool released() const noexcept { return released_; }

  // Why the last write() had a fault, for people; empty when it had none. Not for the loop.
  std::string reason() const { return refused_ ? "the kernel refused to set the lines" : ""; }

 private:
  std::unique_ptr<OutputLines> lines_;
  std::unique_ptr<Modulator> modulator_;
  OutputSettings settings_;
  const Clock& clock_;
  Sample held_;
  bool refused_ = false;
  bool released_ = true;
};

}  // namespace sinerig::gpio
