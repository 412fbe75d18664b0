// Inside of config: how the sections hold on to toml++, which no other file includes.
#pragma once

#include <string>

#include <toml++/toml.h>

#include "config/section.h"

namespace sinerig::config {

struct RigFile::Document {
  toml::table root;
};

struct Section::Node {
  const toml::table* table;
};

// "config/gimbal.toml:12: "
inline std::string place(const std::string& file, const toml::source_region& source) {
  return file + ":" + std::to_string(source.begin.line) + ": ";
}

}  // namespace sinerig::config
