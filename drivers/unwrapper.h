// Angles that start again at their end.
#pragma once

#include <cmath>

#include "sweep/nonblocking.h"

namespace sinerig {

// Makes a wrapping angle continuous: each step is taken as the shorter way round.
class Unwrapper {
 public:
  explicit Unwrapper(double modulus) noexcept : modulus_{modulus} {}

  double apply(double wrapped) noexcept SINERIG_NONBLOCKING {
    if (modulus_ <= 0.0 || !std::isfinite(wrapped)) return wrapped;
    if (started_) turns_ -= std::nearbyint((wrapped - last_wrapped_) / modulus_);
    started_ = true;
    last_wrapped_ = wrapped;
    return wrapped + turns_ * modulus_;
  }

 private:
  double modulus_;
  double last_wrapped_ = 0.0;
  double turns_ = 0.0;
  bool started_ = false;
};

}  // namespace sinerig
