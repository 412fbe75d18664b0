#include "identify/loop_conversions.h"

#include <stdexcept>

namespace sinerig::identify {

using Complex = std::complex<double>;

LoopSignal loop_signal(const std::string& name) {
  if (name == "plant") return LoopSignal::plant;
  if (name == "loop") return LoopSignal::loop;
  if (name == "sensitivity") return LoopSignal::sensitivity;
  if (name == "complementary") return LoopSignal::complementary;
  throw std::invalid_argument("loop: \"" + name +
                              "\" is none of plant, loop, sensitivity, complementary");
}

Curve loop_from(const Curve& measured, LoopSignal signal) {
  if (signal == LoopSignal::sensitivity)
    return measured.mapped([](Complex S) { return 1.0 / S - 1.0; },
                           [](Complex S) { return -1.0 / (S * S); });
  if (signal == LoopSignal::complementary)
    return measured.mapped([](Complex T) { return T / (1.0 - T); },
                           [](Complex T) { return 1.0 / ((1.0 - T) * (1.0 - T)); });
  return measured;
}

Curve sensitivity(const Curve& loop) {
  return loop.mapped([](Complex L) { return 1.0 / (1.0 + L); },
                     [](Complex L) { return -1.0 / ((1.0 + L) * (1.0 + L)); });
}

Curve complementary_sensitivity(const Curve& loop) {
  return loop.mapped([](Complex L) { return L / (1.0 + L); },
                     [](Complex L) { return 1.0 / ((1.0 + L) * (1.0 + L)); });
}

Curve plant_from_loop(const Curve& loop, const Curve& controller) {
  return loop.times(controller.mapped([](Complex C) { return 1.0 / C; },
                                      [](Complex C) { return -1.0 / (C * C); }));
}

}  // namespace sinerig::identify
