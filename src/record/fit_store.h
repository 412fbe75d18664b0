// Fits kept in the sweep file they were made from; read_sweep gives them back.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace sinerig::record {

// Adds a row to the table `fit`; earlier ones stay. The table is made when missing; one that
// another program made gets the columns that it lacks, and its own get what the fit has under their
// name where they must not be empty. input, output: channels. json: one object with num, den,
// delay_s, …, what `sinerig fit --json` prints. Throws SweepFileError.
void store_fit(const std::string& path, std::uint32_t input, std::uint32_t output,
               const std::string& method, const std::string& json);

// The json of the latest fit of that pair of channels by maximum likelihood, the one with error
// bars; nothing when there is none, nor in the table of another program. Throws SweepFileError.
std::optional<std::string> last_fit(const std::string& path, std::uint32_t input,
                                    std::uint32_t output);

}  // namespace sinerig::record
