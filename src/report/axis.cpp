#include "report/axis.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace sinerig::report {

namespace {

constexpr double round_off = 1e-9;
constexpr int most_ticks = 1000;  // far above what any picture has room for

// 2·10⁻⁷ for a value of one digit.
std::string power_label(double value) {
  const int exponent = static_cast<int>(std::floor(std::log10(std::abs(value)) + round_off));
  const double mantissa = value / std::pow(10.0, exponent);
  char text[32];
  std::snprintf(text, sizeof text, "%.3g·", mantissa);
  std::string label = std::abs(mantissa - 1.0) < round_off ? "10" : std::string{text} + "10";
  static constexpr std::array digits{"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  if (exponent < 0) label += "⁻";
  for (const char digit : std::to_string(std::abs(exponent)))
    label += digits.at(static_cast<std::size_t>(digit - '0'));
  return label;
}

}  // namespace

double Axis::operator()(double value) const {
  const double part =
      logarithmic ? std::log(value / low) / std::log(high / low) : (value - low) / (high - low);
  return from + part * (to - from);
}

double nice_step(double span, double count) {
  const double raw = span / count;
  const double base = std::pow(10.0, std::floor(std::log10(raw)));
  for (const double digit : {1.0, 2.0, 5.0}) {
    if (digit * base >= raw * (1.0 - round_off)) return digit * base;
  }
  return 10.0 * base;
}

double angle_step(double span_deg, double count) {
  constexpr std::array steps{15.0, 30.0, 45.0, 90.0, 180.0, 360.0, 720.0, 1440.0};
  if (span_deg / count < 10.0) return nice_step(span_deg, count);
  const auto* const found = std::find_if(steps.begin(), steps.end(),
                                         [&](double step) { return span_deg / step <= count; });
  return found == steps.end() ? nice_step(span_deg, count) : *found;
}

Ticks linear_ticks(double low, double high, double step) {
  Ticks ticks;
  const double first = std::ceil(low / step - round_off);
  for (int i = 0; i < most_ticks; ++i) {
    const double value = (first + i) * step;
    if (!(value <= high + step * round_off)) break;
    // Where the step is below the rounding of the values the next tick is this one again.
    if (!ticks.major.empty() && !(value > ticks.major.back())) break;
    ticks.major.push_back(value);
  }
  return ticks;
}

Ticks log_ticks(double low, double high, double room) {
  const double decades = std::log10(high / low);
  if (decades < 0.75) return linear_ticks(low, high, nice_step(high - low, std::max(2.0, room)));
  const bool fine = room / decades >= 3.0;
  const int every = std::max(1, static_cast<int>(std::ceil(decades / room)));
  Ticks ticks;
  const int first = static_cast<int>(std::floor(std::log10(low) + round_off));
  const int last = static_cast<int>(std::ceil(std::log10(high) - round_off));
  for (int decade = first; decade <= last; ++decade) {
    for (int digit = 1; digit < 10; ++digit) {
      const double value = digit * std::pow(10.0, decade);
      if (value < low * (1.0 - round_off) || value > high * (1.0 + round_off)) continue;
      const bool round_number = digit == 1 || (fine && (digit == 2 || digit == 5));
      if (round_number && decade % every == 0) {
        ticks.major.push_back(value);
      } else if (digit == 1 || room / decades >= 1.4) {
        ticks.minor.push_back(value);
      }
    }
  }
  return ticks;
}

std::string tick_label(double value, double step) {
  char text[32];
  if (step > 0.0) {
    const int places =
        std::clamp(-static_cast<int>(std::floor(std::log10(step) + round_off)), 0, 9);
    std::snprintf(text, sizeof text, "%.*f", places, std::abs(value) < step * 1e-6 ? 0.0 : value);
  } else if (value != 0.0 && (std::abs(value) < 1e-4 || std::abs(value) >= 1e6)) {
    return power_label(value);
  } else {
    std::snprintf(text, sizeof text, "%.6g", value);
  }
  std::string label = text;
  const std::size_t sign = label.find('-');
  if (sign == 0) label.replace(sign, 1, "−");
  return label;
}

}  // namespace sinerig::report
