// Whether the modes that transients are modelled with hold: where they come from, what is held
// against them, and what is measured again when they do not.
#include <algorithm>
#include <numbers>
#include <optional>

#include "sweep/runner.h"

namespace sinerig {

namespace {

constexpr double relative_to_db = 20.0 / std::numbers::ln10;

// Once what disagrees has been measured again, others may stand out.
constexpr int most_reviews = 3;

// One of so many modelled points may stray and be measured again.
constexpr std::uint32_t most_strays = 8;

// Beside what ModelTrust::Judgement says.
constexpr double review_inconclusive = 3.0;

}  // namespace

void SweepRunner::check_model() noexcept {
  const Measurement& measurement = run_.measurement();
  trust_.dwell_ended(dwell_, measurement.modelled(), measurement.model_refuted());
  const std::optional<Check>& check = measurement.check();
  if (!check) return;
  announce({.kind = EventKind::checked,
            .dwell = dwell_,
            .tick = last_tick_,
            .value = relative_to_db * check->disagreement});
  if (!check->agrees) trust_.contradicted();
}

// The first pass, in which the modes are found.
void SweepRunner::probe(bool disturbed) noexcept {
  prober_.add(observations_, disturbed);
  if (!prober_.running()) judge_model();
}

// What the probe found is used from here on.
void SweepRunner::judge_model() noexcept {
  Measurement& measurement = run_.measurement();
  const KnownModes* found = prober_.found();
  const bool doubted = trust_.doubted();
  bool use = found != nullptr;
  if (doubted) {
    const ModelTrust::Judgement judgement = trust_.probed(found, measurement.modes());
    announce({.kind = EventKind::model_doubted,
              .dwell = dwell_,
              .tick = last_tick_,
              .value = static_cast<double>(judgement)});
    for (std::uint32_t dwell = 0; dwell < dwells_.size(); ++dwell) {
      if (judgement == ModelTrust::Judgement::confirmed || !trust_.condemned(dwell)) continue;
      announce({.kind = EventKind::condemned, .dwell = dwell, .tick = last_tick_});
    }
    if (judgement == ModelTrust::Judgement::given_up) measurement.stop_modelling();
    // Confirmed modes, too: what dwells have made of them was doubted.
    use = found != nullptr && judgement != ModelTrust::Judgement::given_up;
  }
  if (use) measurement.know(found->prior, found->noise_variance, found->noise_dof);
  announce({.kind = EventKind::probed,
            .dwell = dwell_,
            .tick = last_tick_,
            .value = found != nullptr ? static_cast<double>(found->prior.modes) : 0.0});
  if (!doubted) recovery_.next_dwell();
  if (doubted) next_dwell();
}

void SweepRunner::next_condemned() noexcept {
  dwell_ = std::min(trust_.next_condemned(0), static_cast<std::uint32_t>(dwells_.size()));
  if (dwell_ == dwells_.size()) review();
}

// All dwells are done: is there one that the others contradict?
void SweepRunner::review() noexcept {
  if (reviews_ == most_reviews || !run_.measurement().models()) return;
  ++reviews_;
  review_.ask(run_.measurement().modes());
  if (review_.ready()) {
    hear_review();
    return;
  }
  // Nothing moves while the answer is waited for.
  excitation_.fade(plan_.baseline.ramp_samples);
}

void SweepRunner::hear_review() noexcept {
  review_.close();
  const auto strays = [&](std::uint32_t dwell) {
    return trust_.modelled(dwell) && review_.disagreement(dwell) > 0.0;
  };
  std::uint32_t modelled = 0;
  std::uint32_t stray = 0;
  for (std::uint32_t dwell = 0; dwell < dwells_.size(); ++dwell) {
    modelled += trust_.modelled(dwell) ? 1U : 0U;
    stray += strays(dwell) ? 1U : 0U;
  }
  if (stray == 0) return;
  // Where many stray, it is the model of the sweep that is too small: said, not acted upon.
  if (stray > std::max(1U, modelled / most_strays)) {
    announce({.kind = EventKind::model_doubted,
              .dwell = dwell_,
              .tick = last_tick_,
              .value = review_inconclusive});
    return;
  }
  for (std::uint32_t dwell = 0; dwell < dwells_.size(); ++dwell) {
    if (!strays(dwell)) continue;
    const double disagreement = review_.disagreement(dwell);
    trust_.condemn(dwell);
    announce({.kind = EventKind::condemned,
              .dwell = dwell,
              .tick = last_tick_,
              .value = relative_to_db * disagreement});
  }
  next_condemned();
}

}  // namespace sinerig
