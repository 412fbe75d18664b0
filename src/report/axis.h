// Axes of the pictures: values to pixels, ticks on round numbers.
#pragma once

#include <string>
#include <vector>

namespace sinerig::report {

// Maps [low, high] onto [from, to] pixels, linearly or by the logarithm.
struct Axis {
  double low = 0.0;
  double high = 1.0;
  double from = 0.0;
  double to = 1.0;
  bool logarithmic = false;

  double operator()(double value) const;
};

struct Ticks {
  std::vector<double> major;  // labelled
  std::vector<double> minor;
};

// The smallest of 1, 2, 5 · 10ⁿ that divides `span` into at most `count` steps.
double nice_step(double span, double count);

// The same for degrees: 15, 30, 45, 90, 180, 360 … from 15 up.
double angle_step(double span_deg, double count);

// The multiples of `step` in [low, high], a thousand at most.
Ticks linear_ticks(double low, double high, double step);

// Decades, or 1-2-5 where there is room for `room` labels; equal steps inside one decade.
Ticks log_ticks(double low, double high, double room);

// As few digits as tell ticks `step` apart (0: as the value needs), with a true minus sign.
std::string tick_label(double value, double step);

}  // namespace sinerig::report
