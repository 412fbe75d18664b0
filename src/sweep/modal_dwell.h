// A dwell whose transient is modelled, as the loop sees it: keeps the samples, asks for a look at
// them beside the loop, hears the verdict.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "sweep/deputy.h"
#include "sweep/modal_settling.h"
#include "sweep/modal_store.h"
#include "sweep/nonblocking.h"

namespace sinerig {

class ModalDwell {
 public:
  // `channels` of the observations, the first of them what was applied; `outputs` of the responses.
  ModalDwell(std::size_t channels, std::vector<std::size_t> outputs, double rate_hz);

  // Solving for modes takes longer than a tick: where time is real, it is done on another thread.
  // Before the loop begins.
  void solve_elsewhere();

  // What is known of the plant's modes: from here on dwells can be modelled. `noise_variance` per
  // output.
  void know(const ModePrior& prior, std::span<const double> noise_variance,
            double noise_dof) noexcept SINERIG_NONBLOCKING {
    settling_.know(prior, noise_variance, noise_dof);
    modes_ = settling_.prior();
  }
  bool knows() const noexcept { return settling_.knows(); }
  void forget() noexcept { settling_.forget(); }
  // As last heard of: the solver may be at work on its own.
  const ModePrior& modes() const noexcept { return modes_; }

  // The dwell begins, or begins anew; it is not modelled.
  void leave() noexcept SINERIG_NONBLOCKING;
  // … it is. The samples of the first few ticks, in which older commands show, are left out.
  void start(const ModalTask& task) noexcept SINERIG_NONBLOCKING;

  // One tick.
  void add(Phasor tone, std::span<const Observation> observations) noexcept SINERIG_NONBLOCKING;

  // No verdict yet.
  bool live() const noexcept { return live_; }
  bool accepted() const noexcept { return verdict_ == ModalVerdict::accepted; }
  bool abandoned() const noexcept { return verdict_ == ModalVerdict::abandoned; }
  // Abandoned because more is left than the noise.
  bool refuted() const noexcept { return abandoned() && settling_.doubt() == ModalDoubt::residual; }
  const ModalResult& result(std::size_t output) const noexcept { return settling_.result(output); }

  // The dwell ends without a verdict: what is known best is asked for with the first call; true
  // once it is there, or nothing will come.
  bool concluded() noexcept SINERIG_NONBLOCKING;
  // … is in the results. False where nothing is.
  bool conclude() noexcept SINERIG_NONBLOCKING;

 private:
  std::unique_ptr<Deputy> make_solver(Deputy::Where where);
  void begin() noexcept;
  void look() noexcept;
  void hear() noexcept;

  ModalSettling settling_;
  ModalStore store_;
  std::unique_ptr<Deputy> solver_;
  ModalTask task_;
  ModePrior modes_;
  std::uint64_t look_count_ = 0;                   // samples that it is to look at
  bool last_look_ = false;                         // … to say the best that is known as well
  ModalVerdict answer_ = ModalVerdict::going_on;   // the solver's, of its last look
  ModalVerdict verdict_ = ModalVerdict::going_on;  // of the dwell
  bool looking_ = false;                           // the solver has been asked and not yet heard
  bool concluding_ = false;                        // … for the last time
  bool waiting_ = false;  // it is busy with what has gone; this dwell begins when it is done
  bool live_ = false;
  std::uint64_t blind_left_ = 0;
};

}  // namespace sinerig
