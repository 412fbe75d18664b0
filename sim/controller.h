// A controller around the simulated plant, for identification under feedback.
#pragma once

#include <cstdint>

namespace sinerig::sim {

enum class Injection : std::uint8_t {
  reference,    // the command is the reference: u = K (command − y)
  plant_input,  // the command is added behind the controller: u = command − K y
};

struct ControllerSettings {
  double proportional = 0.0;
  double integral = 0.0;       // per second
  double derivative = 0.0;     // seconds
  double derivative_hz = 0.0;  // first-order filter of the derivative; 0 = none
  Injection injection = Injection::reference;
};

// A PID in positional form, once per period (backward differences).
class Controller {
 public:
  struct Signals {
    double error = 0.0;        // reference − feedback
    double control = 0.0;      // of the controller alone
    double plant_input = 0.0;  // control, plus the command where it is injected there
  };

  Controller(const ControllerSettings& settings, double period_s) noexcept;

  const Signals& step(double command, double feedback) noexcept;
  const Signals& signals() const noexcept { return signals_; }

 private:
  ControllerSettings settings_;
  double period_s_;
  double filter_;  // of the derivative: weight of the new value
  double integral_ = 0.0;
  double derivative_ = 0.0;
  double last_error_ = 0.0;
  Signals signals_;
};

}  // namespace sinerig::sim
