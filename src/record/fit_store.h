// Fits kept in the sweep file they were made from; read_sweep gives them back.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace sinerig::record {

// Adds a row to the table `fit` (made when missing); earlier ones stay. input, output: channels.
// json: one object with num, den, delay_s, …, what `sinerig fit --json` prints.
// Throws SweepFileError.
void store_fit(const std::string& path, std::uint32_t input, std::uint32_t output,
               const std::string& method, const std::string& json);

// The json of the latest fit of that pair of channels by maximum likelihood, the one with error
// bars; nothing when there is none. Throws SweepFileError.
std::optional<std::string> last_fit(const std::string& path, std::uint32_t input,
                                    std::uint32_t output);

}  // namespace sinerig::record
