// A response measured elsewhere, from a CSV file, as a fit wants it: in order, without gaps.
#pragma once

#include <string>
#include <vector>

#include "identify/response.h"

namespace sinerig::cli {

struct CsvResponse {
  identify::Response response;
  std::vector<double> weights;  // of the column `weight`, one per point; empty without one
  double hold_rate_hz = 0.0;    // of the hold between input and output; 0: none, or not said
};

// The points of a record::CsvTable whose status, where the file has one, is good or imported, with
// the columns std, of each of re and im, or var_re, cov_re_im, var_im; weight, above zero;
// hold_rate_hz, the rate of the zero-order hold that drove the plant. Refused, by line: what is no
// number or not finite, frequencies that are not above zero, not rising or there twice, values left
// out. Refused as a whole, unless trust_units: what looks like another unit than the column's (std
// above |H|; dB and degrees as re and im). Throws record::SweepFileError.
CsvResponse read_csv_response(const std::string& path, bool trust_units);

// One number per line (a line of names and remarks are passed over), for `--weights FILE`.
// Throws record::SweepFileError.
std::vector<double> read_number_column(const std::string& path);

}  // namespace sinerig::cli
