#include "sweep/model_trust.h"

#include <bit>
#include <cmath>

namespace sinerig {

namespace {

// Two abandoned dwells of the last ten: with the right modes one in three hundred is abandoned.
constexpr std::uint32_t window = (1U << 10U) - 1U;
constexpr int most_abandoned = 1;

// Modes are replaced this often; then none hold. Where they are found again and again and still
// leave too much, the rig is no linear system: each dwell is judged by itself.
constexpr int most_replacements = 2;
constexpr int most_probes = 4;

// Poles are the same within this many standard errors and this part of themselves: what a dwell
// knows of them is linearised, and they do move a little with amplitude and temperature.
constexpr double same_sigmas = 4.0;
constexpr double same_decay = 0.05;
constexpr double same_frequency = 1e-3;

// Standard error of a decay, relative.
constexpr double hardly = 0.05;

}  // namespace

ModelTrust::ModelTrust(std::size_t dwells)
    : modelled_(dwells), condemned_(dwells), by_detection_(dwells) {}

void ModelTrust::condemn(std::uint32_t dwell) noexcept {
  condemned_[dwell] = 1;
  by_detection_[dwell] = 1;
  modelled_[dwell] = 0;
}

void ModelTrust::contradicted() noexcept {
  contradicted_ = true;
  doubted_ = true;
}

void ModelTrust::dwell_ended(std::uint32_t dwell, bool modelled, bool abandoned) noexcept {
  modelled_[dwell] = modelled ? 1 : 0;
  recent_ = ((recent_ << 1U) | (abandoned ? 1U : 0U)) & window;
  doubted_ = std::popcount(recent_) > most_abandoned && probes_ < most_probes;
}

ModelTrust::Judgement ModelTrust::probed(const KnownModes* found, const ModePrior& used) noexcept {
  doubted_ = false;
  recent_ = 0;
  ++probes_;
  const bool same = found != nullptr && same_modes(found->prior, used);
  if (same && !contradicted_) return Judgement::confirmed;
  const bool give_up = same || found == nullptr || ++replacements_ > most_replacements;
  contradicted_ = false;
  for (std::size_t i = 0; i < modelled_.size(); ++i) {
    if (modelled_[i] != 0) condemned_[i] = 1;
    modelled_[i] = 0;
  }
  return give_up ? Judgement::given_up : Judgement::replaced;
}

std::uint32_t ModelTrust::next_condemned(std::uint32_t from) const noexcept {
  std::uint32_t dwell = from;
  while (dwell < condemned_.size() && condemned_[dwell] == 0) ++dwell;
  return dwell;
}

namespace {

// Each mode of one has its like in the other, whatever their order.
bool has_all_of(const ModePrior& one, const ModePrior& other) noexcept {
  std::size_t row = 0;
  for (const ModePole& pole : one.known()) {
    bool found = false;
    std::size_t other_row = 0;
    for (const ModePole& like : other.known()) {
      if (like.real() == pole.real()) {
        const auto variance = [&](std::size_t k) {
          const std::size_t a = row + k;
          const std::size_t b = other_row + k;
          return one.covariance[triangle(a) + a] + other.covariance[triangle(b) + b];
        };
        const double decay = std::abs(pole.sigma_rad_s - like.sigma_rad_s);
        const double turn = std::abs(pole.omega_rad_s - like.omega_rad_s);
        const bool same_sigma =
            decay <= same_sigmas * std::sqrt(variance(0)) + same_decay * std::abs(pole.sigma_rad_s);
        const bool same_omega =
            pole.real() || turn <= same_sigmas * std::sqrt(variance(1)) +
                                       same_frequency * std::abs(pole.omega_rad_s);
        found = found || (same_sigma && same_omega);
      }
      other_row += like.size();
    }
    const double doubt = std::sqrt(one.covariance[triangle(row) + row]);
    const bool hardly_known = pole.real() && doubt > hardly * std::abs(pole.sigma_rad_s);
    if (!found && !hardly_known) return false;
    row += pole.size();
  }
  return true;
}

}  // namespace

bool same_modes(const ModePrior& one, const ModePrior& other) noexcept {
  return has_all_of(one, other) && has_all_of(other, one);
}

}  // namespace sinerig
