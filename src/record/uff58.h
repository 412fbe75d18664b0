// Universal file format, dataset 58: what modal analysis programs exchange.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "record/measured.h"

namespace sinerig::record {

// One dataset per response: function type 4 (frequency response), complex double, uneven abscissa,
// ASCII. The format has no place for covariance and status, and 12 columns for a frequency: H keeps
// 13 digits, the frequency 10 to 11. Points without a response are left out.
// `run_name` and the channels stand in the identification lines.
void write_uff58(std::ostream& stream, const StoredRun& run,
                 const std::vector<const StoredResponse*>& responses, const std::string& run_name);

// The frequency responses of a file, others are passed over: single or double, real or complex,
// even or uneven abscissa in Hz (rad/s where its label says so). Throws SweepFileError: no such
// dataset, the binary variant, a number that is none.
std::vector<ImportedResponse> read_uff58(const std::string& path);

}  // namespace sinerig::record
