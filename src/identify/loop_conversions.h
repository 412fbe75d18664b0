// Plant P, controller C, loop L = PC, sensitivity S = 1/(1+L) and complementary sensitivity
// T = L/(1+L) out of one another (negative feedback; Skogestad and Postlethwaite, Multivariable
// Feedback Control, section 2.2). Scatter goes along to first order: δS = −S² δL and so on.
#pragma once

#include <string>

#include "identify/loop_curve.h"

namespace sinerig::identify {

enum class LoopSignal { plant, loop, sensitivity, complementary };

// The name of a signal in options and messages: plant, loop, sensitivity, complementary.
// Throws std::invalid_argument for any other.
LoopSignal loop_signal(const std::string& name);

// L out of a measured S (L = 1/S − 1) or T (L = T/(1−T)), or L itself. For the plant, P = L.
Curve loop_from(const Curve& measured, LoopSignal signal);

Curve sensitivity(const Curve& loop);
Curve complementary_sensitivity(const Curve& loop);
// P = L/C. Relative errors are taken as independent.
Curve plant_from_loop(const Curve& loop, const Curve& controller);

}  // namespace sinerig::identify
