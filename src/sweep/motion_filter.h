// How a quantity moves, from its samples: what a channel's limits of velocity and acceleration are
// compared with.
#pragma once

#include "sweep/nonblocking.h"

namespace sinerig {

// The samples' difference quotient behind a low-pass of first order, v, and that of v behind
// another one.
struct MotionFilter {
  double velocity = 0.0;
  double acceleration = 0.0;

  // `elapsed_s` above 0 between the two samples, `filter_s` is τ.
  void update(double change, double elapsed_s, double filter_s) noexcept SINERIG_NONBLOCKING {
    const double weight = elapsed_s / (filter_s + elapsed_s);
    const double velocity_before = velocity;
    velocity += weight * (change / elapsed_s - velocity);
    acceleration += weight * ((velocity - velocity_before) / elapsed_s - acceleration);
  }
};

}  // namespace sinerig
