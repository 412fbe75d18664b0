// Whether two measurements of the same pair of channels differ by more than their scatter explains.
#pragma once

#include <string>
#include <vector>

#include "record/sweep_reader.h"

namespace sinerig::record {

struct CompareSettings {
  double tolerance_db = 0.0;   // a smaller change of the gain is none
  double tolerance_deg = 0.0;  // a smaller change of the phase is none
  double false_alarm = 0.01;   // chance to call two equal responses different, over all points
};

// H_other / H_first at one frequency that both have measured.
struct PointDifference {
  double frequency_hz = 0.0;
  double gain_db = 0.0;
  double phase_deg = 0.0;  // within half a turn
  double gain95_db = 0.0;  // half-widths of the joint 95 % intervals; NaN without covariances
  double phase95_deg = 0.0;
  double relative = 0.0;     // |H_other / H_first − 1|
  double probability = 0.0;  // of a difference at least as large from scatter alone; NaN as above
  double gain_probability = 0.0;   // the same of what the gain and the phase alone differ by,
  double phase_probability = 0.0;  // at most
  bool changed = false;
};

struct Difference {
  std::string file;  // the other, as the user knows it
  std::string name;  // of the file and its channels, for people
  std::vector<PointDifference> points;
  std::size_t unmatched = 0;  // frequencies that only one of the two has
  std::size_t unusable = 0;   // matched, but without a usable point in one of the two
  std::size_t lost = 0;       // of these: usable in the first only

  std::size_t changed_points() const;
  bool compared() const { return !points.empty(); }
  bool scatter_known() const;
  // More than a tenth of what could be measured before cannot be any more: a change of the rig,
  // too. Less is a point on the edge of a limit, which falls to one side or the other.
  bool much_lost() const { return 9 * lost > points.size(); }
  bool changed() const { return changed_points() > 0 || much_lost(); }
};

// Points match when their frequencies agree within 1e-6; only points with status good, or imported,
// are compared. The scatter of each is taken as circular (circular_variance), both are added with
// the degrees of freedom of Welch and Satterthwaite, and p = (1 + |d|²/(ν s²))^(−ν/2), the tail of
// F(2, ν). A point has changed when p is below false_alarm divided by the number of points; where
// the change of the gain or of the phase is within its tolerance only the other one counts in d,
// and where both are nothing has changed. Points without known scatter go by the tolerances alone,
// and where only one scatter is known the other is taken as large. Differences of 1e-10 are
// rounding of a file.
Difference compare_responses(const StoredResponse& first, const StoredResponse& other,
                             const CompareSettings& settings);

}  // namespace sinerig::record
