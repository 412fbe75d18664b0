// Whether the modes that transients are modelled with are still believed. A wrong order shows in
// many dwells as more residual than the noise explains, though not in all: what the others gave is
// measured again.
#pragma once

#include <cstdint>
#include <vector>

#include "sweep/known_modes.h"
#include "sweep/nonblocking.h"

namespace sinerig {

class ModelTrust {
 public:
  // Of a sweep of up to `dwells` dwells.
  explicit ModelTrust(std::size_t dwells);

  // A dwell has ended: its transient was modelled, or its model was abandoned for its residual, or
  // neither.
  void dwell_ended(std::uint32_t dwell, bool modelled, bool abandoned) noexcept SINERIG_NONBLOCKING;

  // A dwell measured both ways came out differently: whatever the modes, dwells are modelled
  // wrongly.
  void contradicted() noexcept SINERIG_NONBLOCKING;

  // So many of the last dwells were abandoned that the modes have to be found anew.
  bool doubted() const noexcept { return doubted_; }

  // What a new probe says of the modes in use.
  enum class Judgement : std::uint8_t {
    confirmed,  // they are those that were found again
    replaced,   // the new ones are to be used; what was modelled so far is measured again
    given_up,   // no modes hold: every transient is to be waited for, modelled points included
  };
  Judgement probed(const KnownModes* found, const ModePrior& used) noexcept SINERIG_NONBLOCKING;

  // The dwell's points are the model's, and nothing has spoken against them.
  bool modelled(std::uint32_t dwell) const noexcept { return modelled_[dwell] != 0; }
  // Points of this dwell were modelled wrongly.
  bool condemned(std::uint32_t dwell) const noexcept { return condemned_[dwell] != 0; }
  // The next dwell to measure again at or after this one; `dwells` where there is none.
  std::uint32_t next_condemned(std::uint32_t from) const noexcept;
  // It is to be measured again, by detection.
  void condemn(std::uint32_t dwell) noexcept;
  bool by_detection(std::uint32_t dwell) const noexcept { return by_detection_[dwell] != 0; }
  void acquit(std::uint32_t dwell) noexcept { condemned_[dwell] = 0; }

 private:
  std::vector<std::uint8_t> modelled_;
  std::vector<std::uint8_t> condemned_;
  std::vector<std::uint8_t> by_detection_;
  std::uint32_t recent_ = 0;  // a bit per dwell, the last in the lowest: abandoned
  int probes_ = 0;
  int replacements_ = 0;
  bool doubted_ = false;
  bool contradicted_ = false;
};

// Whether two sets of modes are the same within what is known of them. Real poles that are hardly
// known, fast ones that matter for a few ticks, may be in one of them only.
bool same_modes(const ModePrior& one, const ModePrior& other) noexcept SINERIG_NONBLOCKING;

}  // namespace sinerig
