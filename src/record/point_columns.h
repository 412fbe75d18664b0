// The figures of a point that every format carries under the same name.
#pragma once

#include <array>

#include "record/sweep_reader.h"

namespace sinerig::record {

struct PointColumn {
  const char* name;
  double StoredPoint::*value;
};

inline constexpr std::array point_columns{
    PointColumn{"dof", &StoredPoint::dof},
    PointColumn{"gain_interval_db", &StoredPoint::gain_interval_db},
    PointColumn{"phase_interval_deg", &StoredPoint::phase_interval_deg},
    PointColumn{"input_amplitude", &StoredPoint::input_amplitude},
    PointColumn{"output_amplitude", &StoredPoint::output_amplitude},
    PointColumn{"snr_db", &StoredPoint::snr_db},
    PointColumn{"coherence", &StoredPoint::coherence},
    PointColumn{"distortion", &StoredPoint::distortion},
    PointColumn{"drift_per_s", &StoredPoint::drift_per_s},
    PointColumn{"samples", &StoredPoint::samples},
    PointColumn{"lost", &StoredPoint::lost},
    PointColumn{"seconds", &StoredPoint::seconds},
    PointColumn{"reason_value", &StoredPoint::reason_value},
};

// How H is to be read; stands in the head of every file that is written, in at most 80
// columns.
inline constexpr const char* response_convention =
    "H = Y/U, Y = b1 + j a1, y ~ a0 + a1 cos wt + b1 sin wt: negative phase lags";

}  // namespace sinerig::record
