// Poles or zeros kept in the left half plane.
#pragma once

#include <complex>
#include <vector>

#include "identify/fit_data.h"
#include "identify/levenberg_marquardt.h"
#include "identify/local_model.h"

namespace sinerig::identify {

// Does nothing when the roots already obey freedom. Otherwise mirrors the offenders into the left
// half plane, which keeps |N| and |D| on the axis, fits N anew and refines, refusing steps that
// leave the allowed region; shorter delays are tried beside the one found.
void enforce_constraints(const FitData& data, const Freedom& freedom, Refined& refined);

// Damping below 1e-3, or a real root below that part of the first frequency (in the root's unit).
bool near_axis(std::complex<double> root, double first);

// True where a zero far below the first frequency cancels a pole at the origin over all that was
// measured: such a pole is a drift of the data, and the integrator a loop would see is not there.
bool hides_origin(const std::vector<std::complex<double>>& zeros, double first);

// True where a root lies on the edge of what freedom allows: the data pull it across, and what is
// left of it there is no property of the plant. origin: poles there, which count where they are
// hidden.
bool held_by_constraints(const FitData& data, const Freedom& freedom, const Refined& refined,
                         int origin);

}  // namespace sinerig::identify
