// A response as the source text of a program that goes on with it.
#pragma once

#include <iosfwd>
#include <string>

#include "record/sweep_reader.h"

namespace sinerig::record {

// Python: numpy arrays, an FRD of python-control where that is installed, and the misfit of a model
// in standard deviations by scipy. Numbers round-trip.
void write_python_snippet(std::ostream& stream, const StoredRun& run,
                          const StoredResponse& response, const std::string& source);

// MATLAB or Octave: arrays, and an frd.
void write_matlab_snippet(std::ostream& stream, const StoredRun& run,
                          const StoredResponse& response, const std::string& source);

}  // namespace sinerig::record
