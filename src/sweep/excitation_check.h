// Is the commanded sine really there? A read-back without it, with something else in it, or with
// the sign turned is found within two blocks, before a night is spent on measuring nothing.
#pragma once

#include <complex>
#include <cstdint>

#include "sweep/estimator.h"
#include "sweep/nonblocking.h"

namespace sinerig {

enum class ExcitationFault : std::uint8_t {
  none,
  missing,          // value: amplitude relative to the command
  other_frequency,  // value: part of the signal's power that is at the commanded frequencies
  reversed,         // value: phase against the command, degrees
};

struct ExcitationVerdict {
  ExcitationFault fault = ExcitationFault::none;
  double value = 0.0;
  double limit = 0.0;
};

// What was applied, in the unit of the command: `measured` and `commanded` as b + j a.
ExcitationVerdict check_applied(std::complex<double> measured, std::complex<double> commanded,
                                double min_excitation) noexcept SINERIG_NONBLOCKING;

// A sensor that reads the excitation back in a unit of its own; its sign is judged where
// `and_sign`.
ExcitationVerdict check_readback(const ChannelContent& measured, std::complex<double> commanded,
                                 bool and_sign) noexcept SINERIG_NONBLOCKING;

}  // namespace sinerig
