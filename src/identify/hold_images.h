// What dividing by the factor of the hold leaves out: the images, as a correction on the grid.
#pragma once

#include <optional>

#include <Eigen/Core>

#include "identify/fit_data.h"
#include "identify/hold_model.h"
#include "identify/local_model.h"

namespace sinerig::identify {

// The exact response of the model behind the hold over the model times plain.known, which carries
// the factor of the hold and no images. Multiplied to known it makes the cheap model, whose
// derivatives are in closed form, an exact one as long as the parameters stay. Nothing where a root
// makes it infinite.
std::optional<Eigen::ArrayXcd> hold_images(const FitData& plain, const Freedom& freedom,
                                           const GridRational& rational, const HoldModel& hold);

// known · N/D · exp(−jω·delay).
Eigen::ArrayXcd model_on_grid(const FitData& data, const GridRational& rational);

}  // namespace sinerig::identify
