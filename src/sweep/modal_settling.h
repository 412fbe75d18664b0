// The decisions of a dwell whose transient is modelled: when the response is known well enough,
// when the model of the transient is not to be believed. A pure function of the samples and of
// what earlier dwells have taught.
#pragma once

#include <algorithm>
#include <array>
#include <complex>
#include <cstdint>
#include <vector>

#include "sweep/modal_estimate.h"
#include "sweep/modal_store.h"
#include "sweep/mode_prior.h"
#include "sweep/noise_memory.h"
#include "sweep/point_interval.h"

namespace sinerig {

enum class ModalVerdict : std::uint8_t {
  going_on,
  accepted,   // the results are those of the dwell
  abandoned,  // the modes do not explain the samples: the dwell has to settle by itself
};

// Why a dwell was abandoned.
enum class ModalDoubt : std::uint8_t {
  none,
  residual,      // more is left than the noise explains
  undetermined,  // the window does not determine the tone beside the modes
  store_full,    // longer than what can be kept
  not_a_sine,    // what was applied has harmonics
};

struct ModalTask {
  double omega_rad_s = 0.0;
  std::uint64_t cycle_samples = 1;  // rounded
  std::uint64_t least_samples = 0;  // of the window
  double target_db = 0.0;           // half widths wanted; 0: none
  double target_deg = 0.0;

  double relative_target() const noexcept { return smaller_target(target_db, target_deg); }
};

struct ModalResult {
  Estimate estimate{};
  PooledVariance variance{};
  bool known = false;
};

class ModalSettling {
 public:
  // `outputs`: channels of the store that are measured, the first is judged. Channel 0 is what was
  // applied.
  ModalSettling(std::vector<std::size_t> outputs, double rate_hz);

  // What is known before the first dwell. `noise_variance` per output, known to `noise_dof`.
  void know(const ModePrior& prior, std::span<const double> noise_variance,
            double noise_dof) noexcept;
  bool knows() const noexcept { return known_; }
  void forget() noexcept { known_ = false; }
  const ModePrior& prior() const noexcept { return prior_; }

  void start(const ModalTask& task) noexcept;

  // Looks at the first `count` samples of the store.
  ModalVerdict look(const ModalStore& store, std::uint64_t count) noexcept;

  // The best that is known; for the end of a dwell at its limit.
  void conclude(const ModalStore& store) noexcept;

  const ModalResult& result(std::size_t output) const noexcept { return results_[output]; }
  ModalDoubt doubt() const noexcept { return doubt_; }
  // Samples at which another look is worth the while.
  std::uint64_t next_look() const noexcept {
    const std::uint64_t next = blocks_end_ + block_length_;
    return blocks_end_ < task_.least_samples && next > task_.least_samples ? task_.least_samples
                                                                           : next;
  }

 private:
  static constexpr std::size_t most_blocks = 48;
  struct Blocks {
    std::array<ModalSums, most_blocks> sums;
    std::array<std::uint64_t, most_blocks + 1> edge{};
  };
  struct OutputNoise {
    double variance = 0.0;
    double dof = 0.0;
  };

  void accumulate(const ModalStore& store, std::size_t channel, std::uint64_t begin,
                  std::uint64_t end, ModalSums& sums) noexcept;
  void merge() noexcept;
  void total(std::size_t from, ModalSums& sums) const noexcept;
  bool solve_window() noexcept;
  bool needs_other_poles() const noexcept;
  void linearise_again(const ModalStore& store, std::size_t channel) noexcept;
  void relinearise_regression() noexcept;
  void believe() noexcept;
  void limit_doubt() noexcept;
  void learn_noise(std::size_t output) noexcept;
  double expected_noise(std::size_t output) const noexcept;
  double noise_of_window(std::size_t output, const ModalSolution& solution) const noexcept;
  bool fill_result(const ModalStore& store, std::size_t output) noexcept;
  bool fit_input(const ModalStore& store) noexcept;
  double target_excess() const noexcept;
  ModalVerdict not_determined() noexcept;
  bool late_half_agrees() noexcept;
  bool residual_explained(std::size_t output) const noexcept;
  bool take_other_outputs(const ModalStore& store) noexcept;
  void move_prior() noexcept;
  bool settle_poles(const ModalStore& store) noexcept;
  void doubt_poles(const ModalStore& store) noexcept;
  ModalVerdict decide(const ModalStore& store) noexcept;

  std::vector<std::size_t> outputs_;
  double rate_hz_;
  ModePrior prior_;
  bool known_ = false;
  std::array<double, ModePrior::max_parameters> most_variance_{};  // of the prior's parameters
  PoleBelief belief_;
  std::vector<OutputNoise> noise_;
  std::vector<NoiseMemory> memories_;
  std::vector<ModalResult> results_;

  ModalTask task_;
  std::array<ModePole, ModePrior::max_modes> poles_{};  // linearised at
  ModalRegression regression_;
  ModalSolver solver_;
  NormalSolver inverse_;
  NormalSums inverse_sums_;
  NormalSums input_sums_;
  ModalSums cluster_;
  std::array<double, max_modal_columns> by_sine_{};
  std::array<double, max_modal_columns> by_cosine_{};
  std::array<double, max_modal_columns> product_{};
  ModalSolution solution_;
  ModalSolution late_;
  Blocks blocks_;
  ModalSums window_;
  std::size_t block_count_ = 0;
  std::uint64_t block_length_ = 16;
  std::uint64_t blocks_end_ = 0;  // samples that are in blocks
  int linearisations_ = 0;
  bool doubted_poles_ = false;
  std::complex<double> input_;
  double input_residual_ = 0.0;
  ModalDoubt doubt_ = ModalDoubt::none;
  std::array<double, triangle(ModePrior::max_parameters)> posterior_{};
};

}  // namespace sinerig
