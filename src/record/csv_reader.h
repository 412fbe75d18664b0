// Responses from comma separated values.
#pragma once

#include <string>

#include "record/measured.h"

namespace sinerig::record {

// Lines that begin with # are remarks; `# input: NAME [UNIT]` and `# output: …` name the channels.
// The next line names the columns: freq_hz or omega_rad_s; re and im, or gain_db (or gain) with
// phase_deg (or phase_rad); the scatter as var_re, cov_re_im, var_im, or std, the standard
// deviation of each of re and im; then any figure of `sinerig export`. Without such a line the
// columns are freq_hz,re,im[,std]. Separators: comma, semicolon or tab. An empty field is no value.
// Throws SweepFileError with file, line and what is wrong.
ImportedResponse read_csv(const std::string& path);

}  // namespace sinerig::record
