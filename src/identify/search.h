// The search for the global minimum: linear stage from many starts and delays, then refinement.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "identify/fit_data.h"
#include "identify/levenberg_marquardt.h"
#include "identify/local_model.h"

namespace sinerig::identify {

enum class Effort { quick, thorough };

struct SearchSettings {
  Effort effort = Effort::thorough;
  int random_starts = 10;
  std::uint64_t seed = 1;
  std::optional<double> near_delay_s;  // profile only about 1.5 rad around this delay
  std::vector<GridRational> warm;      // known good solutions: a lower order, no delay, a neighbour
};

// True when the cost is what noise alone leaves: χ² within `width` standard deviations of its mean
// where the scatter is known, otherwise only for data that are exact to rounding.
bool explained_by_noise(const FitData& data, const Freedom& freedom, double cost, double width);

// The best of all starts. Ends early once a result is explained by noise, or a second start has
// come to the same minimum and that is explained by noise at three standard deviations.
// With freedom.delay the delays of the interval are profiled first, the start delay_s = 0 among
// them, so that the cost never exceeds that without delay.
Refined search(const FitData& data, const Freedom& freedom, const SearchSettings& settings);

// The largest delay that the phase of the response allows for: its unwrapped fall plus the lead
// that the numerator can give, over the band. In seconds, above zero.
double largest_plausible_delay(const FitData& data, Degrees degrees);

}  // namespace sinerig::identify
