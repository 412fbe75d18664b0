// Fits kept in the sweep file they were made from.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace sinerig::record {

struct StoredFit {
  std::string created_utc;  // filled in when it is stored
  std::uint32_t input = 0;  // channels
  std::uint32_t output = 0;
  std::string method;
  std::string json;  // what `sinerig fit --json` prints
};

// Adds a fit; earlier ones stay. Throws SweepFileError.
void store_fit(const std::string& path, const StoredFit& fit);

// All fits of a file, oldest first; none where it has never been fitted.
std::vector<StoredFit> read_fits(const std::string& path);

}  // namespace sinerig::record
