// MATLAB files, version 5.
#pragma once

#include <string>
#include <vector>

#include "record/measured.h"

namespace sinerig::record {

// Top-level variables as `frd` and `idfrd` want them, for ny outputs, nu inputs and nf frequencies:
// ResponseData (ny×nu×nf, complex), Frequency (nf×1), FrequencyUnit, CovarianceData
// (ny×nu×nf×2×2: var re, cov; cov, var im), InputName, OutputName, InputUnit, OutputUnit (cells),
// Ts; then the figures of each point under their names in the CSV and status, reason (ny×nu×nf).
// NaN where a pair was not measured. Throws SweepFileError when the responses do not share their
// frequencies, or the file cannot be written in full: what was there before then is still there.
void write_mat(const std::string& path, const StoredRun& run,
               const std::vector<const StoredResponse*>& responses);

// The same variables, at the top level or as fields of one struct; of them ResponseData and
// Frequency are needed. FrequencyUnit: Hz, kHz, rad/s (default, as for frd), rpm.
// Throws SweepFileError.
std::vector<ImportedResponse> read_mat(const std::string& path);

}  // namespace sinerig::record
