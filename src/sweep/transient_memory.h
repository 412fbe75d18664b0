// What the points measured before tell of the transient that a change of tone excites: how large it
// can be, and how fast it moves against the tone.
#pragma once

#include <array>
#include <complex>
#include <cstddef>

#include "sweep/nonblocking.h"

namespace sinerig {

struct TransientBound {
  double size = 1.0;        // at the change, relative to the response
  double rate_rad_s = 0.0;  // |pole − jω| of the mode that dominates; 0: not known
};

class TransientMemory {
 public:
  // The output cannot jump, so what the transient starts with is the difference of the two steady
  // states. And where one mode dominates, H = R / (jω − p), two points give the distance of the
  // pole: |p − jω| = |ω' − ω| |H'| / |H' − H|. The larger size and the lower rate of the last two
  // changes are taken, lest the differences of several modes happen to cancel.
  TransientBound bound(std::complex<double> response, double omega_rad_s,
                       double amplitude) const noexcept SINERIG_NONBLOCKING;

  void learn(std::complex<double> response, double omega_rad_s,
             double amplitude) noexcept SINERIG_NONBLOCKING;

 private:
  struct Lesson {
    double omega_rad_s = 0.0;
    double amplitude = 0.0;
    std::complex<double> response;
  };
  std::array<Lesson, 2> lessons_{};  // newest first
  std::size_t count_ = 0;
};

}  // namespace sinerig
