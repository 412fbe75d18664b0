// Where a fit gets its response from: a sweep file, or one measured elsewhere.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "cli/csv_response.h"
#include "identify/response.h"

namespace sinerig::cli {

struct FitInput {
  identify::Response response;
  bool sweep_file = false;
  double rate_hz = 0.0;            // of the loop that drove the plant; 0: not known
  double hold_hz = 0.0;            // the same where its hold lies between input and output; 0: none
  bool driven_by_command = false;  // the input is what the sweep put out, not a sensor
  std::uint32_t input = 0;         // channels of the sweep file
  std::uint32_t output = 0;
  std::vector<double> weights;           // one per point; empty where the file has none
  std::vector<double> band_edges_rad_s;  // between the sub-bands of the sweep; empty without them
  std::string label;                     // "applied to encoder", or the file
};

// A sweep file: the good points of the channel (the first sensor where it is empty), scatter pooled
// over neighbours. .mat, .uff and .unv: the same, as read_measured reads them. Anything else: CSV,
// as read_csv_response takes it. Throws std::invalid_argument and record::SweepFileError.
FitInput read_fit_input(const std::string& path, const std::string& channel,
                        bool trust_units = false);

// The hold that the input was measured behind, as the user says; 0: none. Also the rate of the loop
// where that is not known.
void take_hold(FitInput& input, double hold_hz);

// Frequencies in rad/s, geometrically halfway, between bands in Hz (lowest, highest); empty where
// two of them overlap or there is only one.
std::vector<double> edges_between(std::vector<std::pair<double, double>> bands_hz);

}  // namespace sinerig::cli
