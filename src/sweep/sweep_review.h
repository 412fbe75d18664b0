// One model of the whole sweep against every point of it: what a dwell cannot know of itself, its
// neighbours tell.
//
//   H(ζ) = Σ c_i (1 − z_i) / (ζ − z_i) + Σ w_d ζ^−d + integrators + lags,
//   ζ = e^{jωT}, z_i = e^{s_i T}
//
// is exact for modes behind a hold and a dead time of any part of a tick; c and w are linear, the
// poles s are those that the dwells have found, and move as far as they are doubted; lags of a few
// ticks stand for what is too fast for a dwell. Each point is held against the model of all the
// others (the deleted residual of a regression; Cook and Weisberg, Residuals and Influence in
// Regression, 1982, section 2.2).
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "sweep/deputy.h"
#include "sweep/mode_prior.h"
#include "sweep/nonblocking.h"
#include "sweep/normal_equations.h"
#include "sweep/records.h"

namespace sinerig {

class SweepReview {
 public:
  // `tolerance`: relative; what is closer than half of it to the model agrees. All memory is taken
  // here. Where time is real it is done on another thread.
  SweepReview(std::size_t dwells, std::size_t responses, double rate_hz, double tolerance,
              Deputy::Where where);

  // The latest of a dwell and a response.
  void set(const Point& point) noexcept SINERIG_NONBLOCKING;

  // Nothing of this may be called between ask() and ready(), but these two.
  void ask(const ModePrior& modes) noexcept SINERIG_NONBLOCKING;
  bool asked() const noexcept { return asked_; }
  bool ready() const noexcept SINERIG_NONBLOCKING { return asked_ && deputy_.idle(); }

  // Takes note of the answer.
  void close() noexcept { asked_ = false; }

  // Of the responses of a dwell, the largest: relative; 0 where they agree or nothing can be told.
  double disagreement(std::uint32_t dwell) const noexcept { return disagreements_[dwell]; }

 private:
  static constexpr std::size_t most_taps = 5;
  static constexpr std::size_t integrators = 2;
  static constexpr std::size_t fast_lags = 4;
  static constexpr std::size_t most_columns =
      2 * ModePrior::max_parameters + most_taps + integrators + fast_lags;

  struct Seen {
    std::complex<double> response;
    double omega_rad_s = 0.0;
    double variance = 0.0;  // of each component
    bool known = false;
  };
  using Row = std::array<std::complex<double>, most_columns>;

  void review() noexcept;
  void review(std::size_t response) noexcept;
  void regressors(double omega_rad_s) noexcept;
  bool fit(std::size_t response) noexcept;
  void compare(const Seen& seen, double& disagreement) noexcept;

  double period_s_;
  double tolerance_;
  std::size_t dwells_;
  std::vector<Seen> seen_;  // dwells of a response one after the other
  std::vector<double> disagreements_;
  bool asked_ = false;

  ModePrior modes_;
  std::array<ModePole, ModePrior::max_modes> poles_{};  // as they have moved
  std::size_t parameters_ = 0;
  std::size_t linear_ = 0;
  std::size_t columns_ = 0;
  Row row_{};
  std::array<double, most_columns> beta_{};
  std::array<double, ModePrior::max_parameters> moved_{};
  NormalSums sums_;
  NormalSolver solver_;
  Deputy deputy_;  // last: it uses the others
};

}  // namespace sinerig
