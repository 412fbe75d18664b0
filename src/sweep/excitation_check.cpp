#include "sweep/excitation_check.h"

#include <cmath>
#include <numbers>

namespace sinerig {

namespace {

// A read-back lags: a fieldbus cycle or a current loop turns the phase, but not by this much at the
// frequencies where a sweep begins.
constexpr double largest_lag_deg = 120.0;

// A sine that was asked for and is there holds most of its channel's power.
constexpr double least_tone_part = 0.5;

ExcitationVerdict check_sign(std::complex<double> measured,
                             std::complex<double> commanded) noexcept {
  const double phase_deg = std::arg(measured / commanded) * 180.0 / std::numbers::pi;
  if (std::abs(phase_deg) <= largest_lag_deg) return {};
  return {.fault = ExcitationFault::reversed, .value = phase_deg, .limit = largest_lag_deg};
}

}  // namespace

ExcitationVerdict check_applied(std::complex<double> measured, std::complex<double> commanded,
                                double min_excitation) noexcept {
  const double ratio = std::abs(measured) / std::abs(commanded);
  if (!(ratio >= min_excitation)) {
    return {.fault = ExcitationFault::missing, .value = ratio, .limit = min_excitation};
  }
  return check_sign(measured, commanded);
}

ExcitationVerdict check_readback(const ChannelContent& measured, std::complex<double> commanded,
                                 bool and_sign) noexcept {
  const double total = measured.tone_power + measured.foreign_power;
  if (!(total > 0.0)) return {.fault = ExcitationFault::missing, .value = 0.0, .limit = 0.0};
  const double part = measured.tone_power / total;
  if (part < least_tone_part) {
    return {.fault = ExcitationFault::other_frequency, .value = part, .limit = least_tone_part};
  }
  return and_sign ? check_sign(measured.first_tone, commanded) : ExcitationVerdict{};
}

}  // namespace sinerig
