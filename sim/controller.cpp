#include "sim/controller.h"

#include <cmath>
#include <numbers>

namespace sinerig::sim {

Controller::Controller(const ControllerSettings& settings, double period_s) noexcept
    : settings_{settings},
      period_s_{period_s},
      filter_{settings.derivative_hz > 0.0
                  ? 1.0 - std::exp(-2.0 * std::numbers::pi * settings.derivative_hz * period_s)
                  : 1.0} {}

const Controller::Signals& Controller::step(double command, double feedback) noexcept {
  const bool at_reference = settings_.injection == Injection::reference;
  signals_.error = (at_reference ? command : 0.0) - feedback;
  integral_ += signals_.error * period_s_;
  derivative_ += filter_ * ((signals_.error - last_error_) / period_s_ - derivative_);
  last_error_ = signals_.error;
  signals_.control = settings_.proportional * signals_.error + settings_.integral * integral_ +
                     settings_.derivative * derivative_;
  signals_.plant_input = signals_.control + (at_reference ? 0.0 : command);
  return signals_;
}

}  // namespace sinerig::sim
