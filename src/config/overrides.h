// A rig file with some of its values replaced, as text: what is run, stored and resumed is one
// whole rig file again.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace sinerig::config {

// {path, value}: {"sweep.amplitude", "0.1"}, {"sensor.encoder.max", "2"}; the value is TOML.
using Override = std::pair<std::string, std::string>;

// `text` with each value in its place, or below the header of its section where the key is new, or
// in a section of its own at the end. Everything else stays as it is. Throws ConfigError naming
// `name` and the path.
std::string with_overrides(std::string text, const std::string& name,
                           const std::vector<Override>& overrides);

// The line of a value in `text`, from 1; 0 where there is none: {"night.sweep[0].rig"}.
std::size_t line_of(const std::string& text, const std::string& name, const std::string& path);

}  // namespace sinerig::config
