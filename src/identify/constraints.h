// Poles or zeros kept in the left half plane.
#pragma once

#include "identify/fit_data.h"
#include "identify/levenberg_marquardt.h"
#include "identify/local_model.h"

namespace sinerig::identify {

// Does nothing when the roots already obey freedom. Otherwise mirrors the offenders into the left
// half plane, which keeps |N| and |D| on the axis, fits N anew and refines, refusing steps that
// leave the allowed region.
void enforce_constraints(const FitData& data, const Freedom& freedom, Refined& refined);

}  // namespace sinerig::identify
