// Universal file format, dataset 58: what modal analysis programs exchange.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "record/measured.h"

namespace sinerig::record {

// Whether there is a point to write: a dataset of none is one that few programs read.
bool fits_uff58(const StoredResponse& response);

// One dataset per response that has a point: function type 4 (frequency response), complex double,
// uneven abscissa, ASCII. The format has no place for covariance and status, and 13 columns for a
// frequency: H keeps 13 digits, the frequency 10, below 1 mHz 9. Points without a response are left
// out. `run_name` and the channels stand in the identification lines, which have 80 columns: a long
// name is cut off in front of its unit.
void write_uff58(std::ostream& stream, const StoredRun& run,
                 const std::vector<const StoredResponse*>& responses, const std::string& run_name);

// The frequency responses of a file, others are passed over: single or double, real or complex,
// even or uneven abscissa in Hz (rad/s where its label says so). One without points is passed over.
// Throws SweepFileError: no such dataset, the binary variant, a number that is none.
std::vector<ImportedResponse> read_uff58(const std::string& path);

}  // namespace sinerig::record
