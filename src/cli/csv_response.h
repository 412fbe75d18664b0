// A response measured elsewhere, from a CSV file, as a fit wants it: in order, without gaps.
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "identify/response.h"

namespace sinerig::cli {

// A file that cannot be read as a response: says which line, what was found and what is wanted.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct CsvResponse {
  identify::Response response;
  std::vector<double> weights;  // of the column `weight`, one per point; empty without one
  double hold_rate_hz = 0.0;    // of the hold between input and output; 0: none, or not said
};

// Columns by a line of names: freq_hz or omega_rad_s; re and im, or gain_db (or gain) with
// phase_deg (or phase_rad); optionally std, of each of re and im, or var_re, cov_re_im, var_im;
// weight, above zero; hold_rate_hz, the rate of the zero-order hold that drove the plant; status,
// whose points are left out unless it says good or imported. Other columns are passed over. Without
// a line of names: freq_hz, re, im[, std]. Comma, semicolon or tab; lines that begin with # are
// remarks. Refused, by line: what is no number or not finite, frequencies that are not above zero,
// not rising or there twice, values left out. Refused as a whole, unless trust_units: what looks
// like another unit than the column's (std above |H|; dB and degrees as re and im). Throws
// InputError.
CsvResponse read_csv_response(const std::string& path, bool trust_units);

// One number per line (a line of names and remarks are passed over), for `--weights FILE`.
std::vector<double> read_number_column(const std::string& path);

}  // namespace sinerig::cli
