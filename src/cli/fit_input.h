// Where a fit gets its response from: a sweep file, or one measured elsewhere.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

#include "identify/response.h"

namespace sinerig::cli {

// A file that cannot be read as a response: says which line, what was found and what is wanted.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct FitInput {
  identify::Response response;
  bool sweep_file = false;
  double rate_hz = 0.0;     // of the loop that drove the plant; 0: not known
  std::uint32_t input = 0;  // channels of the sweep file
  std::uint32_t output = 0;
  std::string label;  // "applied to encoder", or the file
};

// A sweep file: the good points of the channel (the first sensor where it is empty), scatter pooled
// over neighbours. .mat, .uff and .unv: the same, as read_measured reads them. Anything else: CSV,
// either with a header that names freq_hz, re, im and optionally std or var_re, cov_re_im, var_im
// and status, or without one: freq_hz, re, im[, std]. std is that of each of re and im. Lines that
// start with # are skipped. Throws InputError and record::SweepFileError.
FitInput read_fit_input(const std::string& path, const std::string& channel);

}  // namespace sinerig::cli
