// One dwell, from its first tick to its points: accumulate, see the transient go, go on until the
// intervals meet the target, say how good it is. Pure functions of samples: a virtual run is
// deterministic to the bit.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "sweep/estimator.h"
#include "sweep/modal_dwell.h"
#include "sweep/noise_memory.h"
#include "sweep/nonblocking.h"
#include "sweep/plan.h"
#include "sweep/point_interval.h"
#include "sweep/records.h"
#include "sweep/regression.h"
#include "sweep/transient_memory.h"

namespace sinerig {

// A modelled dwell that has been measured by detection as well.
struct Check {
  double disagreement = 0.0;  // of the responses that differ most, relative
  bool agrees = true;         // within the noise of both, or half the target
};

// How a dwell begins.
struct Beginning {
  bool by_detection = false;  // its transient is not modelled
  bool from_rest = false;     // not out of the dwell before
};

// A pair of regression channels (0 is what was applied, 1… the sensors) whose ratio is a response.
// A dwell goes on until all have settled and, unless the target is of the first only, meet it.
using Pairs = std::vector<Pair>;

// The output channel of each.
std::vector<std::size_t> outputs_of(const Pairs& pairs);

class Measurement {
 public:
  // Takes all memory for dwells of up to `max_bins` bins.
  Measurement(std::size_t channels, std::size_t max_bins, std::size_t max_tones, Pairs pairs,
              Judgement judgement, double rate_hz);

  // What is known of the plant's modes: from here on the transients of dwells are modelled, where
  // the judgement wants that. `noise_variance` per pair.
  void know(const ModePrior& prior, std::span<const double> noise_variance,
            double noise_dof) noexcept SINERIG_NONBLOCKING;

  // Solving for modes takes longer than a tick: where time is real, it is done on another thread.
  // Before the loop begins.
  void solve_elsewhere();

  void start(const Dwell& dwell, const Beginning& beginning = {}) noexcept SINERIG_NONBLOCKING;

  // One tick after the wait.
  void add(std::span<const Phasor> phasors,
           std::span<const Observation> observations) noexcept SINERIG_NONBLOCKING;

  // The command was late or lost: what has been gathered is void.
  void disturb() noexcept SINERIG_NONBLOCKING;

  // The dwell has been measured as far as it will be.
  bool done() const noexcept { return done_; }

  // The last add() was the first of a block.
  bool block_begins() const noexcept { return begins_; }
  // A block of whole cycles has ended with the last add(); its plain sums, where no sample of the
  // channel is missing.
  bool block_ended() const noexcept { return block_ended_; }
  bool block_complete(std::size_t channel) const noexcept { return block_missing_[channel] == 0; }
  Coefficients block_coefficients(std::size_t channel, std::size_t tone) const noexcept {
    return regression_.block_coefficients(channel, tone,
                                          static_cast<double>(dwell_->block_samples));
  }

  // What the block holds of a channel, whatever is missing of it, referred to the true time of its
  // samples. Nothing where too little is there.
  std::optional<ChannelContent> block_content(std::size_t channel) noexcept SINERIG_NONBLOCKING;

  // Takes the judgement as it stands, for the end of the dwell or a stop in the midst of it.
  void conclude() noexcept SINERIG_NONBLOCKING;
  Point point(std::size_t pair, std::size_t tone) const noexcept SINERIG_NONBLOCKING;
  const Pairs& pairs() const noexcept { return pairs_; }

  // What the concluded window has taught; nothing where there was too little to estimate.
  std::optional<Lesson> lesson(std::size_t pair,
                               std::size_t tone) const noexcept SINERIG_NONBLOCKING;

  // Learns again what an earlier run of the same plan has: `dwell` is the one of the lesson, and
  // lessons come in the order in which they were taught.
  void recall(const Lesson& lesson, const Dwell& dwell) noexcept;

  // Of the dwell that has ended: the model of its transient ended it, or was abandoned because it
  // left more than the noise.
  bool modelled() const noexcept { return by_model_; }
  bool model_refuted() const noexcept { return modal_ && modal_->refuted(); }
  // … or was drawn to be measured both ways.
  const std::optional<Check>& check() const noexcept { return check_; }
  const ModePrior& modes() const noexcept { return modal_->modes(); }
  bool models() const noexcept { return modal_ && modal_->knows(); }
  // From here on transients are waited for.
  void stop_modelling() noexcept SINERIG_NONBLOCKING {
    if (modal_) modal_->forget();
  }

 private:
  struct Result {
    Estimate estimate{};
    PooledVariance variance{};
    Stray late{};        // of the late half
    double left = 0.0;   // what the transient may have left in H, relative
    bool still = false;  // nothing of the transient is left that the tolerance would see
    bool known = false;
    bool no_input = false;  // not known because nothing was applied
  };

  void judge() noexcept;
  Interval interval(const Result& result, double scale = 1.0) const noexcept {
    return interval_of(result.estimate.response, result.variance, result.left, scale);
  }
  void start_modal() noexcept;
  void take_modal() noexcept;
  void end_modelled() noexcept;
  bool drawn() const noexcept;
  SettledBy settled_by() const noexcept;
  void hold_against_model() noexcept;
  void take_back_modelled() noexcept;
  void restart() noexcept;
  void end_part() noexcept;
  Window current_window() noexcept;
  bool evaluate(std::size_t pair, const Window& window) noexcept;
  bool still(const Window& window) noexcept;
  void look_for_transient(std::size_t pair, const Window& window) noexcept;
  bool may_ring() const noexcept;
  bool target_met(std::size_t pair, bool as_it_is = false) const noexcept;
  double settling_tolerance() const noexcept;
  std::size_t parts_per_block() const noexcept;
  Result& result(std::size_t pair, std::size_t tone) noexcept {
    return results_[pair * max_tones_ + tone];
  }
  const Result& result(std::size_t pair, std::size_t tone) const noexcept {
    return results_[pair * max_tones_ + tone];
  }

  Pairs pairs_;
  Judgement judgement_;
  double rate_hz_;
  std::size_t max_tones_;
  Regression regression_;
  WindowEstimator estimator_;
  std::vector<NoiseMemory> memories_;         // per pair
  std::vector<Result> results_;               // per pair and tone
  std::vector<Estimate> estimates_;           // of the window under evaluation
  std::vector<Stray> strays_;                 // per tone
  std::vector<TransientMemory> transients_;   // per pair
  std::vector<double> omega_;                 // per bin
  std::vector<std::uint64_t> block_missing_;  // per channel

  std::unique_ptr<ModalDwell> modal_;  // where transients are modelled
  bool by_model_ = false;              // the model of its transient ended this dwell
  bool by_detection_ = false;          // … is not to be modelled
  bool at_limit_ = false;              // it ended because its time was up
  bool checking_ = false;              // it has been modelled, and goes on
  std::vector<Result> modelled_;       // per pair, of the dwell being checked
  std::optional<Check> check_;

  const Dwell* dwell_ = nullptr;
  std::uint64_t samples_ = 0;  // since the start or the last disturbance
  std::uint32_t part_ = 0;     // within the block
  std::uint64_t in_block_ = 0;
  std::uint64_t next_look_ = 0;
  std::size_t first_ = 0;   // checkpoint at which the window under judgement begins
  std::size_t stride_ = 1;  // of the regression when first_ was set
  // What was applied has harmonics that the regression does not model (a clamped or a coarse
  // command): they are orthogonal to the tone over whole blocks only.
  bool whole_blocks_ = false;
  bool block_ended_ = false;
  bool begins_ = false;
  bool done_ = false;
  bool taught_ = false;  // the memories have taken in this dwell
  bool foreseen_ =
      false;  // it began out of a dwell that they have taken in, and went on from there
};

}  // namespace sinerig
