// State-space form in modal coordinates: well conditioned, and each state means something.
#pragma once

#include "identify/state_space.h"
#include "identify/transfer_function.h"

namespace sinerig::identify {

// A block per mode by rising frequency: [σ ω; −ω σ] for a pole pair σ ± jω, [σ] for a real pole, a
// chain of integrators first for poles at the origin. Every block is scaled so that its part of B
// and of C have the same size: rows of A·x, B·u and C·x are then of the size of the mode's residue.
// Where poles other than those at the origin are closer than 1e-6 of their magnitude the partial
// fractions do not exist in numbers, and the chain of to_state_space comes back.
// Throws std::invalid_argument as to_state_space does.
StateSpace to_modal_form(const ZerosPolesGain& model);

}  // namespace sinerig::identify
