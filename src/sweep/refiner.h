// Where to measure next: between which neighbours the response is known least.
//
// Through the points about a gap go two local rational models, (α + β s) / (1 + γ s) with complex
// coefficients: one through the two ends of the gap and the point before, one through the ends and
// the point behind. One mode on a smooth background is such a model, so both find a resonance
// between two points; where they disagree by more than the noise of the points explains, the
// response is not known (the additive uncertainty of Choe's sub-band models, eq. (10), used to
// decide where to measure).
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "sweep/nonblocking.h"
#include "sweep/plan.h"

namespace sinerig {

class Refiner {
 public:
  // Takes all memory for `max_points` points of `responses` responses each.
  Refiner(const Refinement& refinement, double rate_hz, std::size_t max_points,
          std::size_t responses);

  // Begins the point at `frequency_hz`; each response of it follows by set(). Where there is one
  // already, or no room, what follows is ignored.
  void add(double frequency_hz) noexcept SINERIG_NONBLOCKING;
  void set(std::size_t response, std::complex<double> value,
           double variance) noexcept SINERIG_NONBLOCKING;
  // All responses of the point are there.
  void learn() noexcept SINERIG_NONBLOCKING;

  // The candidate to measure next, or nothing: the response is known within the tolerance, or the
  // candidates of the gaps where it is not are used up.
  std::optional<std::size_t> next() noexcept SINERIG_NONBLOCKING;

  // The candidate has been measured already.
  void use(std::size_t candidate) noexcept { used_[candidate] = true; }

  // Largest disagreement over all gaps, dB.
  double worst_db() const noexcept SINERIG_NONBLOCKING;

 private:
  struct Value {
    std::complex<double> response;
    double variance = 0.0;  // of each component
    bool known = false;
  };
  struct Gap {
    double disagreement_db = 0.0;
    double at_hz = 0.0;
  };
  struct Model {
    std::complex<double> alpha;
    std::complex<double> beta;
    std::complex<double> gamma;
    bool valid = false;

    std::complex<double> at(double frequency_hz) const noexcept;
    double pole_hz() const noexcept;
  };
  struct Node {
    double frequency_hz = 0.0;
    std::complex<double> response;
  };
  using Nodes = std::array<Node, 4>;  // before the gap, its ends, behind it

  static Model through(const Node& a, const Node& b, const Node& c) noexcept;
  Value& value(std::size_t response, std::size_t point) noexcept {
    return values_[response * frequencies_.size() + point];
  }
  void look(std::size_t gap) noexcept;
  void look(std::size_t response, std::size_t gap, Gap& worst) noexcept;

  const Refinement& refinement_;
  std::vector<double> candidates_hz_;
  std::vector<bool> used_;
  std::size_t responses_;
  std::size_t count_ = 0;
  std::size_t newest_ = 0;
  bool adding_ = false;
  std::vector<double> frequencies_;
  std::vector<Value> values_;
  std::vector<Gap> gaps_;
};

}  // namespace sinerig
